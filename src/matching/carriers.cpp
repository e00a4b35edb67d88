#include "carriers.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "cometric.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/random/brownian.hpp"
#include "representatives.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Coordinates, beyond which the matrices of a search over paths cost too much: no more carriers than these have, and
// fewer landmarks all carry themselves where most would have to.
constexpr Index kMostCoordinates = 3000;

// Of any misfit, what carriers may leave unexplained. To first order J comes out greater by no more than this part.
constexpr double kUnexplained = 1e-3;
// Products with R for its norm: half of it is missed with a chance below 2 % for 10⁵ landmarks (Kuczyński &
// Woźniakowski 1992, theorem 4.2).
constexpr int kNormProducts = 8;
// These cost as much as m columns did where m² is so many times the number of landmarks.
constexpr Index kNormPays = 12;

// What the columns of m landmarks leave of P = √D K √D, D the precisions: R = P − CCᵀ, C of the pivoted Cholesky
// factorisation, N×m.
class LeftOver {
 public:
  LeftOver(const KernelOperator& kernel, const Points& q, const VectorXd& precision)
      : kernel_(kernel),
        q_(q),
        root_(precision.cwiseSqrt()),
        diagonal_(kernel.at_zero() * precision),
        least_(1e-13 * diagonal_.maxCoeff()) {}

  double trace() const { return diagonal_.sum(); }
  Index count() const { return count_; }

  /// The landmark that is explained worst; none where that is by round-off.
  std::optional<Index> worst() const {
    Index a = 0;
    return diagonal_.maxCoeff(&a) > least_ ? std::optional(a) : std::nullopt;
  }

  void take(Index pivot) {
    if (count_ == columns_.cols()) columns_.conservativeResize(q_.cols(), std::max<Index>(64, 2 * count_));
    VectorXd column = root_[pivot] * root_.cwiseProduct(VectorXd(kernel_.gram(q_, q_.col(pivot))));
    column.noalias() -= columns_.leftCols(count_) * columns_.row(pivot).head(count_).transpose();
    columns_.col(count_) = column / std::sqrt(column[pivot]);
    diagonal_ = (diagonal_ - columns_.col(count_).cwiseAbs2()).cwiseMax(0);
    diagonal_[pivot] = 0;
    ++count_;
  }

  /// The greatest eigenvalue of R, from below, by Lanczos' method from a random vector.
  double norm() const {
    VectorXd v = brownian_increments(0, 0, static_cast<int>(q_.cols()), {1, 1});
    v.normalize();
    VectorXd before = VectorXd::Zero(v.size()), diagonal = VectorXd::Zero(kNormProducts), beside = diagonal;
    int k = 0;
    while (true) {
      VectorXd next = product(v) - (k > 0 ? beside[k - 1] : 0) * before;
      diagonal[k] = next.dot(v);
      next -= diagonal[k] * v;
      beside[k] = next.norm();
      if (++k == kNormProducts || !(beside[k - 1] > kEps * diagonal[0])) break;
      before = std::exchange(v, next / beside[k - 1]);
    }
    Eigen::SelfAdjointEigenSolver<MatrixXd> eigen;
    eigen.computeFromTridiagonal(diagonal.head(k), beside.head(k - 1), Eigen::EigenvaluesOnly);
    return eigen.eigenvalues()[k - 1];
  }

 private:
  static constexpr double kEps = 1e-12;

  VectorXd product(const VectorXd& x) const {
    Points p = Points::Zero(q_.rows(), q_.cols());
    p.row(0) = root_.cwiseProduct(x).transpose();
    const auto columns = columns_.leftCols(count_);
    return root_.cwiseProduct(kernel_.apply(q_, q_, p).row(0).transpose()) - columns * (columns.transpose() * x);
  }

  const KernelOperator& kernel_;
  const Points& q_;
  VectorXd root_;      ///< √D
  VectorXd diagonal_;  ///< of R
  double least_;       ///< of it that is no round-off
  MatrixXd columns_;   ///< C, with room
  Index count_ = 0;    ///< m
};

// c + ½|U(q − m)ᵀ|², the same U for each axis, the root of a form.
class QuadraticTerm final : public DataTerm {
 public:
  QuadraticTerm(const QuadraticForm& form, Points centre, double least)
      : form_(form), centre_(std::move(centre)), least_(least) {}

  double value(const Points& q) const override { return least_ + 0.5 * whitened(q - centre_).squaredNorm(); }

  Points gradient(const Points& q) const override { return whitened(q - centre_).transpose() * form_.root; }

  Linearisation linearise(const Points& q, const MatrixXd& changes) const override {
    const Index d = q.rows(), m = q.cols();
    Linearisation at{residual(q), MatrixXd::Zero(q.size() + 1, changes.cols())};
    for (Index axis = 0; axis < d; ++axis)
      at.changes.middleRows(axis * m, m) = form_.root * MatrixXd(changes(Eigen::seqN(axis, m, d), Eigen::all));
    return at;
  }

  bool is_least_squares() const override { return true; }

  VectorXd residual(const Points& q) const override {
    VectorXd r(q.size() + 1);
    r << whitened(q - centre_).reshaped(), std::sqrt(2 * least_);
    return r;
  }

  const QuadraticForm* form_of_each_axis() const override { return &form_; }

 private:
  MatrixXd whitened(const Points& change) const { return form_.root * change.transpose(); }

  const QuadraticForm& form_;
  Points centre_;
  double least_;
};

// The precision of the coordinates of each landmark; empty where it differs between them.
VectorXd precisions(const LandmarkTerm& observed, const Points& q) {
  VectorXd all(q.cols());
  for (Index a = 0; a < q.cols(); ++a) {
    const MatrixXd precision = observed.precision(a);
    all[a] = precision(0, 0);
    if (precision != all[a] * MatrixXd::Identity(q.rows(), q.rows())) return {};
  }
  return all;
}

}  // namespace

Carriers::Carriers(const MatchingProblem& problem, std::vector<Index> places)
    : problem_(problem),
      places_(std::move(places)),
      precision_(precisions(*problem.data->landmarks(), problem.source)) {
  const KernelOperator& kernel = problem.system.kernel;
  const Points at = problem.source(Eigen::all, places_);
  MatrixXd gram = kernel.gram(at, at);
  gram.diagonal().array() += regularisation(kernel);
  weights_ = gram.llt().solve(kernel.gram(at, problem.source)).transpose();
  const MatrixXd precise = precision_.cwiseSqrt().asDiagonal() * weights_;
  MatrixXd square = MatrixXd::Zero(std::ssize(places_), std::ssize(places_));
  square.selfadjointView<Eigen::Lower>().rankUpdate(precise.transpose());
  const Eigen::LLT<MatrixXd> factors(square);
  form_ = {factors.matrixU(), factors.solve(MatrixXd::Identity(square.rows(), square.rows()))};
}

MatchingProblem Carriers::problem(const Points& ends, const Points& all) const {
  const Points gradient = problem_.data->gradient(all) * weights_;
  const auto root = form_.root.triangularView<Eigen::Upper>();
  const MatrixXd residual = form_.root.transpose().triangularView<Eigen::Lower>().solve(MatrixXd(gradient.transpose()));
  const MatrixXd centre = ends.transpose() - root.solve(residual);
  const double least = problem_.data->value(all) - 0.5 * residual.squaredNorm();
  MatchingProblem few = problem_;
  few.source = problem_.source(Eigen::all, places_);
  few.data = std::make_shared<QuadraticTerm>(form_, centre.transpose(), std::max(0.0, least));
  return few;
}

Points Carriers::momenta(const Points& of_carriers) const {
  Points all = Points::Zero(problem_.source.rows(), problem_.source.cols());
  all(Eigen::all, places_) = of_carriers;
  return all;
}

namespace {

// Landmarks whose momenta do what those of all do, but for kUnexplained of any misfit: with a displacement of
// covariance TK/λ the data have TK/λ + D⁻¹, which grows by that part if ‖R‖ ≤ kUnexplained·λ/T. The trace of R, no less
// than its norm, is known at every pivot. Others are distributed between them; more than `most` are of no use.
std::vector<Index> explaining(const MatchingProblem& problem, const VectorXd& precision, Index most) {
  const double enough = kUnexplained * problem.lambda / problem.grid.time;
  // So many at least: fields at later times are those of carriers, too, and the ends are interpolated between them.
  std::vector<Index> places = representatives(problem, kFewLandmarks);
  LeftOver left(problem.system.kernel, problem.source, precision);
  for (Index tried = 0; left.count() <= most && left.trace() > enough;) {
    const Index m = left.count();
    if (m * m > kNormPays * problem.source.cols() && 8 * m > 9 * tried) {
      if (left.norm() <= enough) break;
      tried = m;
    }
    const std::optional<Index> pivot = left.worst();
    if (!pivot) break;
    left.take(*pivot);
    places.push_back(*pivot);
  }
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  return places;
}

}  // namespace

std::optional<Carriers> find_carriers(const MatchingProblem& problem) {
  const LandmarkTerm* observed = problem.data->landmarks();
  const Index n = problem.source.cols();
  if (observed == nullptr || n <= 2 * kFewLandmarks) return std::nullopt;
  const VectorXd precision = precisions(*observed, problem.source);
  if (precision.size() == 0) return std::nullopt;
  require_distinct(problem.source);
  const Index most = kMostCoordinates / problem.source.rows();
  std::vector<Index> places = explaining(problem, precision, n <= 2 * most ? 3 * n / 4 : most);
  if (4 * std::ssize(places) > 3 * n && n <= 2 * most) return std::nullopt;
  if (std::ssize(places) > most) places = representatives(problem, most);
  return Carriers(problem, std::move(places));
}

}  // namespace pulson::matching
