#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <fmt/core.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Joined = std::vector<std::pair<int, int>>;

constexpr double kRidge = 1e-9;         // of the mean eigenvalue of G
constexpr double kSumRounding = 1e-12;  // below this part of its terms a sum counts as 0

template <int d>
struct Edge {
  using Vector = Eigen::Matrix<double, d, 1>;
  Vector middle;     // c/w
  Vector vector;     // t
  Vector direction;  // u = t/|t|, or 0
  double length;     // |t|
};
template <int d>
using Edges = std::vector<Edge<d>>;

template <int d>
Edges<d> edges_of(const Points& points, const Joined& joined, double width) {
  Edges<d> edges;
  edges.reserve(joined.size());
  for (const auto& [a, b] : joined) {
    Edge<d> edge;
    edge.middle = (points.col(a) + points.col(b)) / (2 * width);
    edge.vector = points.col(b) - points.col(a);
    edge.length = edge.vector.norm();
    edge.direction.setZero();
    if (edge.length > 0) edge.direction = edge.vector / edge.length;
    edges.push_back(edge);
  }
  return edges;
}

// g of two edges, ∂g/∂t_e and ∂²g/∂t_e∂t_f.
struct CurrentProduct {
  template <int d>
  static double value(const Edge<d>& e, const Edge<d>& f) {
    return e.vector.dot(f.vector);
  }
  template <int d>
  static Eigen::Matrix<double, d, 1> slope(const Edge<d>& /*e*/, const Edge<d>& f) {
    return f.vector;
  }
  template <int d>
  static Eigen::Matrix<double, d, d> mixed(const Edge<d>& /*e*/, const Edge<d>& /*f*/) {
    return Eigen::Matrix<double, d, d>::Identity();
  }
};

// All are 0 where a direction is.
struct VarifoldProduct {
  template <int d>
  static double value(const Edge<d>& e, const Edge<d>& f) {
    const double cosine = e.direction.dot(f.direction);
    return cosine * cosine * e.length * f.length;
  }
  template <int d>
  static Eigen::Matrix<double, d, 1> slope(const Edge<d>& e, const Edge<d>& f) {
    const double cosine = e.direction.dot(f.direction);
    return f.length * cosine * (2 * f.direction - cosine * e.direction);
  }
  template <int d>
  static Eigen::Matrix<double, d, d> mixed(const Edge<d>& e, const Edge<d>& f) {
    const auto& u = e.direction;
    const auto& v = f.direction;
    const double cosine = u.dot(v);
    Eigen::Matrix<double, d, d> result = 2 * v * (u - cosine * v).transpose();
    result += cosine * u * (cosine * v - 2 * u).transpose();
    result.diagonal().array() += 2 * cosine;
    return result;
  }
};

// Calls `sums.template operator()<d, Product>()`.
template <class Sums>
auto dispatch(Index d, CurveMeasure measure, const Sums& sums) {
  if (measure == CurveMeasure::kCurrent)
    return d == 2 ? sums.template operator()<2, CurrentProduct>() : sums.template operator()<3, CurrentProduct>();
  return d == 2 ? sums.template operator()<2, VarifoldProduct>() : sums.template operator()<3, VarifoldProduct>();
}

// <μ,ν>. Products of equal measures are equal to the last bit, so that |μ − ν|² is 0.
template <class Product, int d>
double inner_product(const Edges<d>& mu, const Edges<d>& nu) {
  double sum = 0;
  for (const Edge<d>& e : mu)
    for (const Edge<d>& f : nu) sum += std::exp(-(e.middle - f.middle).squaredNorm()) * Product::value(e, f);
  return sum;
}

// Derivatives of an inner product with respect to one edge's c/w and t.
template <int d>
struct EdgeSlope {
  Eigen::Matrix<double, d, 1> middle = Eigen::Matrix<double, d, 1>::Zero();
  Eigen::Matrix<double, d, 1> vector = Eigen::Matrix<double, d, 1>::Zero();
};

template <class Product, int d>
EdgeSlope<d> slope_of(const Edge<d>& e, const Edges<d>& nu) {
  EdgeSlope<d> sum;
  for (const Edge<d>& f : nu) {
    const Eigen::Matrix<double, d, 1> z = e.middle - f.middle;
    const double k = std::exp(-z.squaredNorm());
    sum.middle -= 2 * k * Product::value(e, f) * z;
    sum.vector += k * Product::slope(e, f);
  }
  return sum;
}

// ∂/∂q ½|μ_q − μ_y|², d×N.
template <class Product, int d>
Points half_square_gradient(const Edges<d>& mu, const Edges<d>& nu, const Joined& joined, double width, Index count) {
  Points gradient = Points::Zero(d, count);
  for (std::size_t e = 0; e < mu.size(); ++e) {
    const EdgeSlope<d> own = slope_of<Product>(mu[e], mu);
    const EdgeSlope<d> other = slope_of<Product>(mu[e], nu);
    const Eigen::Matrix<double, d, 1> shift = (own.middle - other.middle) / (2 * width);
    const Eigen::Matrix<double, d, 1> turn = own.vector - other.vector;
    gradient.col(joined[e].first) += shift - turn;
    gradient.col(joined[e].second) += shift + turn;
  }
  return gradient;
}

// G, with c = (x_a + x_b)/2 and t = x_b − x_a.
template <class Product, int d>
MatrixXd metric(const Edges<d>& mu, const Joined& joined, double width, Index count) {
  using Vector = Eigen::Matrix<double, d, 1>;
  using Block = Eigen::Matrix<double, d, d>;
  MatrixXd result = MatrixXd::Zero(d * count, d * count);
  for (std::size_t e = 0; e < mu.size(); ++e) {
    for (std::size_t f = 0; f < mu.size(); ++f) {
      const Vector z = mu[e].middle - mu[f].middle;
      const double k = std::exp(-z.squaredNorm());
      const double part = k * Product::value(mu[e], mu[f]) / (width * width);
      const Vector slope = k / width * z;
      const Block middles = part * (0.5 * Block::Identity() - z * z.transpose());  // ¼ ∂²/∂c_e∂c_f
      const Block to_vector = -slope * Product::slope(mu[f], mu[e]).transpose();   // ½ ∂²/∂c_e∂t_f
      const Block from_vector = Product::slope(mu[e], mu[f]) * slope.transpose();  // ½ ∂²/∂t_e∂c_f
      const Block vectors = k * Product::mixed(mu[e], mu[f]);                      // ∂²/∂t_e∂t_f
      const auto& [a, b] = joined[e];
      const auto& [i, j] = joined[f];
      result.template block<d, d>(d * a, d * i) += middles - to_vector - from_vector + vectors;
      result.template block<d, d>(d * a, d * j) += middles + to_vector - from_vector - vectors;
      result.template block<d, d>(d * b, d * i) += middles - to_vector + from_vector - vectors;
      result.template block<d, d>(d * b, d * j) += middles + to_vector + from_vector + vectors;
    }
  }
  return result;
}

// Σ_axis 1ᵀG1; 0 where rounding leaves nothing of it.
template <class Product, int d>
double translation_square(const Edges<d>& mu, double width) {
  double sum = 0;
  double terms = 0;
  for (const Edge<d>& e : mu) {
    for (const Edge<d>& f : mu) {
      const double square = (e.middle - f.middle).squaredNorm();
      const double term = std::exp(-square) * Product::value(e, f) * (2 * d - 4 * square) / (width * width);
      sum += term;
      terms += std::abs(term);
    }
  }
  return sum > kSumRounding * terms ? sum : 0;
}

void check_edges(const Joined& edges, Index count, std::string_view curve) {
  for (const auto& [a, b] : edges)
    if (a < 0 || b < 0 || a >= count || b >= count || a == b)
      throw InputError(fmt::format("an edge of the {} joins vertices {} and {}; it must join two of {}", curve, a + 1,
                                   b + 1, count));
}

void check(const Joined& source_edges, int source_vertices, const Curve& target, const CurveTermOptions& options) {
  if (target.points.rows() != 2 && target.points.rows() != 3)
    throw InputError(fmt::format("curves need the plane or space; the target is {}D", target.points.rows()));
  if (!target.points.allFinite()) throw InputError("a coordinate of the target is not a finite number");
  check_edges(source_edges, source_vertices, "source");
  check_edges(target.edges, target.points.cols(), "target");
  if (std::none_of(target.edges.begin(), target.edges.end(),
                   [&](const auto& edge) { return target.points.col(edge.first) != target.points.col(edge.second); }))
    throw InputError("the target is not a curve: its edges have no length");
  require_positive("sigma", options.sigma);
  require_positive("data width", options.width);
}

}  // namespace

CurveTerm::CurveTerm(Joined source_edges, int source_vertices, Curve target, CurveTermOptions options)
    : edges_(std::move(source_edges)), count_(source_vertices), target_(std::move(target)), options_(options) {
  check(edges_, count_, target_, options_);
  const Index d = target_.points.rows();
  const double width = options_.width;
  const auto [square, translation] = dispatch(d, options_.measure, [&]<int D, class Product>() {
    const Edges<D> y = edges_of<D>(target_.points, target_.edges, width);
    return std::pair(inner_product<Product>(y, y), translation_square<Product>(y, width));
  });
  if (!(translation > 0))
    throw InputError(
        fmt::format("the target's edges cancel at a data width of {}; use a varifold, or another width", width));
  target_square_ = square;
  weight_ = count_ * static_cast<double>(d - 1) / translation / (options_.sigma * options_.sigma);
}

void CurveTerm::check_shape(const Points& q) const {
  if (q.rows() != target_.points.rows() || q.cols() != count_)
    throw InputError(fmt::format("{} vertices in {}D do not fit a curve term of {} in {}D", q.cols(), q.rows(), count_,
                                 target_.points.rows()));
}

double CurveTerm::value(const Points& q) const {
  check_shape(q);
  const double square = dispatch(q.rows(), options_.measure, [&]<int d, class Product>() {
    const Edges<d> mu = edges_of<d>(q, edges_, options_.width);
    const Edges<d> nu = edges_of<d>(target_.points, target_.edges, options_.width);
    return inner_product<Product>(mu, mu) - 2 * inner_product<Product>(mu, nu) + target_square_;
  });
  return square < 0 ? 0 : 0.5 * weight_ * square;  // rounding alone makes it negative
}

Points CurveTerm::gradient(const Points& q) const {
  check_shape(q);
  return weight_ * dispatch(q.rows(), options_.measure, [&]<int d, class Product>() {
           const Edges<d> mu = edges_of<d>(q, edges_, options_.width);
           const Edges<d> nu = edges_of<d>(target_.points, target_.edges, options_.width);
           return half_square_gradient<Product>(mu, nu, edges_, options_.width, count_);
         });
}

DataTerm::Linearisation CurveTerm::linearise(const Points& q, const MatrixXd& changes) const {
  const SerialBlas serial;
  check_shape(q);
  MatrixXd g = dispatch(q.rows(), options_.measure, [&]<int d, class Product>() {
    return metric<Product>(edges_of<d>(q, edges_, options_.width), edges_, options_.width, count_);
  });
  const double ridge = kRidge * g.trace() / static_cast<double>(q.size());
  if (ridge == 0) return {Eigen::VectorXd::Zero(q.size()), MatrixXd::Zero(q.size(), changes.cols())};
  g.diagonal().array() += ridge;
  const Eigen::LLT<MatrixXd> factor(weight_ * g);
  MatrixXd images(q.size(), changes.cols());
  if (images.size() > 0) images = factor.matrixU() * changes;  // Eigen's product takes no empty matrix
  return {factor.matrixL().solve(gradient(q).reshaped()), std::move(images)};
}

}  // namespace pulson::matching
