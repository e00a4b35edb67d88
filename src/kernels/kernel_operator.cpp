#include "pulson/kernels/kernel_operator.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <numeric>

#include <fmt/core.h>

#include "core/text.hpp"
#include "line_sums.hpp"
#include "own_kernels.hpp"
#include "pair_sums.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

// As many numbers as the vectors over `count` targets touch: whole blocks, or whole vectors of a single one.
std::size_t padded(Eigen::Index count) {
  const auto n = static_cast<std::size_t>(count);
  const std::size_t unit = n < kTargetBlock ? vector_lanes() : kTargetBlock;
  return (n + unit - 1) / unit * unit;
}

// Coordinate-major copy of a d×N matrix, each row padded with zeros. Small ones need no allocation.
class CoordinateRows {
 public:
  explicit CoordinateRows(const Points& points) : CoordinateRows(padded(points.cols()), points.rows()) {
    double* to = data();
    for (Eigen::Index a = 0; a < points.cols(); ++a)
      for (Eigen::Index c = 0; c < points.rows(); ++c)
        to[static_cast<std::size_t>(c) * stride_ + static_cast<std::size_t>(a)] = points(c, a);
  }
  CoordinateRows(std::size_t stride, Eigen::Index rows) : stride_(stride) {
    const std::size_t size = stride * static_cast<std::size_t>(rows);
    if (size > kSmall) large_ = std::make_unique_for_overwrite<double[]>(size);
    std::fill_n(data(), size, 0.0);
  }

  std::size_t stride() const { return stride_; }
  const double* data() const { return large_ ? large_.get() : small_.data(); }
  double* data() { return large_ ? large_.get() : small_.data(); }
  Points points(Eigen::Index first_row, Eigen::Index rows, Eigen::Index count) const {
    Points points(rows, count);
    const double* from = data() + static_cast<std::size_t>(first_row) * stride_;
    for (Eigen::Index a = 0; a < count; ++a)
      for (Eigen::Index c = 0; c < rows; ++c)
        points(c, a) = from[static_cast<std::size_t>(c) * stride_ + static_cast<std::size_t>(a)];
    return points;
  }

 private:
  static constexpr std::size_t kSmall = 64;
  std::size_t stride_;
  std::array<double, kSmall> small_;  // where `large_` is null
  std::unique_ptr<double[]> large_;
};

// Below this many pairs one thread is faster than starting another (a few 10 µs).
constexpr std::size_t kPairsPerThread = 100'000;

// Beyond it 1/α⁴ leaves the range of numbers.
constexpr double kSmallestAlpha = 1e-70;

void run(PairSumArguments& arguments, const std::vector<KernelTerm>& terms) {
  if (has_own(terms)) return add_plain_pair_sums(arguments, terms);
  const std::size_t blocks = (arguments.target_stride + kTargetBlock - 1) / kTargetBlock;
  const auto add_block = [&](int block) {
    PairSumArguments local = arguments;
    for (const KernelTerm& term : terms) {
      local.term = term;
      add_pair_sums(local, static_cast<std::size_t>(block) * kTargetBlock);
    }
  };
  if (arguments.target_stride * arguments.sources < kPairsPerThread) {
    for (std::size_t block = 0; block < blocks; ++block) add_block(static_cast<int>(block));
  } else {
    parallel_for(static_cast<int>(blocks), add_block);
  }
}

// Σ over the pairs of targets x, which carry u, v and w, and sources y, which carry a, b and c; null where a sum needs
// none. `rows` numbers a target.
CoordinateRows pair_sum(PairSum sum, const std::vector<KernelTerm>& terms, const Points& x, const Points* u,
                        const Points* v, const Points& y, const Points& a, const Points* b, Eigen::Index rows,
                        const Points* w = nullptr, const Points* c = nullptr) {
  const Points none(x.rows(), 0);
  const CoordinateRows x_rows(x), u_rows(u ? *u : none), v_rows(v ? *v : none), w_rows(w ? *w : none);
  const CoordinateRows y_rows(y), a_rows(a), b_rows(b ? *b : none), c_rows(c ? *c : none);
  CoordinateRows out(x_rows.stride(), rows);
  PairSumArguments arguments{.sum = sum,
                             .dimension = static_cast<int>(x.rows()),
                             .term = {},
                             .targets = static_cast<std::size_t>(x.cols()),
                             .sources = static_cast<std::size_t>(y.cols()),
                             .target_stride = x_rows.stride(),
                             .source_stride = y_rows.stride(),
                             .x = x_rows.data(),
                             .u = u_rows.data(),
                             .v = v_rows.data(),
                             .w = w_rows.data(),
                             .y = y_rows.data(),
                             .a = a_rows.data(),
                             .b = b_rows.data(),
                             .c = c_rows.data(),
                             .out = out.data()};
  run(arguments, terms);
  return out;
}

using Indices = std::vector<Eigen::Index>;

// The columns of p that are not zero: the sources that add something to a sum.
Indices nonzero_columns(const Points& p) {
  Indices columns;
  columns.reserve(static_cast<std::size_t>(p.cols()));
  for (Eigen::Index j = 0; j < p.cols(); ++j)
    if (!(p.col(j).array() == 0).all()) columns.push_back(j);
  return columns;
}

Indices all_columns(const Points& points) {
  Indices columns(static_cast<std::size_t>(points.cols()));
  std::iota(columns.begin(), columns.end(), Eigen::Index(0));
  return columns;
}

// All points, or those of the columns.
Points part(const Points& points, const Indices& columns) {
  return static_cast<Eigen::Index>(columns.size()) == points.cols() ? points : Points(points(Eigen::all, columns));
}

Indices complement(const Indices& columns, Eigen::Index count) {
  Indices others;
  others.reserve(static_cast<std::size_t>(count) - columns.size());
  std::size_t next = 0;
  for (Eigen::Index j = 0; j < count; ++j) {
    if (next < columns.size() && columns[next] == j)
      ++next;
    else
      others.push_back(j);
  }
  return others;
}

// Σ over sources y with vectors p at targets x.
CoordinateRows field_sum(PairSum sum, const std::vector<KernelTerm>& terms, const Points& x, const Points& y,
                         const Points& p, Eigen::Index rows) {
  const Indices sources = nonzero_columns(p);
  if (static_cast<Eigen::Index>(sources.size()) == p.cols())
    return pair_sum(sum, terms, x, nullptr, nullptr, y, p, nullptr, rows);
  return pair_sum(sum, terms, x, nullptr, nullptr, y(Eigen::all, sources), p(Eigen::all, sources), nullptr, rows);
}

// Adds to the columns `targets` of `out` the sum over the columns `sources` of one point set.
void add_self_sum(PairSum sum, const std::vector<KernelTerm>& terms, const Points& q, const Points& u, const Points& v,
                  const Points& a, const Points& b, const Indices& targets, const Indices& sources, Points& out) {
  if (targets.empty() || sources.empty()) return;
  if (static_cast<Eigen::Index>(targets.size()) == q.cols() && targets.size() == sources.size()) {
    out += pair_sum(sum, terms, q, &u, &v, q, a, &b, q.rows()).points(0, q.rows(), q.cols());
    return;
  }
  const Points of_u = part(u, targets), of_v = part(v, targets), of_b = part(b, sources);
  const CoordinateRows sums =
      pair_sum(sum, terms, part(q, targets), &of_u, &of_v, part(q, sources), part(a, sources), &of_b, q.rows());
  out(Eigen::all, targets) += sums.points(0, q.rows(), static_cast<Eigen::Index>(targets.size()));
}

// From so many pairs on, sweeps along a line cost less than the pairs: see docs/benchmarks.md.
constexpr Eigen::Index kFewestPairsOnLine = kFewestOnLine * kFewestOnLine;

// Whether sums over these points are sweeps along a line.
bool are_on_line(const std::vector<KernelTerm>& terms, const Points& x, const Points& y) {
  return x.rows() == 1 && x.cols() * y.cols() >= kFewestPairsOnLine && has_line_sums(terms) && x.allFinite() &&
         y.allFinite();
}

// Sums over the points q with the rows of `weights`.
LineSums sums_along(const std::vector<KernelTerm>& terms, const Points& q, const Eigen::MatrixXd& weights) {
  return line_sums(terms, q.transpose(), q.transpose(), weights.transpose());
}

// That targets and sources are points of one space, and that each source has a vector.
void check_sources(const Points& x, const Points& y, const Points& p) {
  if (x.rows() < 1 || x.rows() > 3) throw InputError(fmt::format("points are in {}D; 1D to 3D are known", x.rows()));
  require_size("the sources of a kernel sum", y, x.rows(), y.cols());
  require_size("the vectors at the sources of a kernel sum", p, y.rows(), y.cols());
}

// That two sets of vectors belong to the points q.
void check_vectors(const Points& q, const Points& p, const Points& other) {
  check_sources(q, q, p);
  require_size("the vectors at the points of a kernel sum", other, q.rows(), q.cols());
}

}  // namespace

KernelOperator::KernelOperator(std::vector<KernelTerm> terms) : terms_(std::move(terms)) {
  if (terms_.empty()) throw InputError("a kernel needs at least one term");
  for (const KernelTerm& term : terms_) {
    if (!(std::isfinite(term.alpha) && term.alpha > 0))
      throw InputError(fmt::format("kernel: alpha is {}; it must be greater than 0", term.alpha));
    if (term.alpha < kSmallestAlpha || term.alpha > 1 / kSmallestAlpha)
      throw InputError(
          fmt::format("kernel: alpha is {}; it must be from {} to {}", term.alpha, kSmallestAlpha, 1 / kSmallestAlpha));
    if (!(std::isfinite(term.weight) && term.weight > 0))
      throw InputError(fmt::format("kernel: weight is {}; it must be greater than 0", term.weight));
  }
}

double KernelOperator::at_zero() const { return jet(0).value; }

double KernelOperator::lipschitz() const {
  double sum = 0;
  for (const KernelTerm& term : terms_) {
    const double of_profile =
        is_own(term.profile) ? own_profile(term.profile)->lipschitz() : facts_of(term.profile).lipschitz;
    sum += term.weight / term.alpha * of_profile;
  }
  return sum;
}

RadialJet KernelOperator::jet(double squared_distance) const {
  if (has_own(terms_)) return jets_of(terms_, Eigen::ArrayXd::Constant(1, squared_distance), 2).front();
  RadialJet sum;
  for (const KernelTerm& term : terms_) {
    const RadialJet jet = facts_of(term.profile).jet(term.alpha, squared_distance);
    sum.value += term.weight * jet.value;
    sum.first += term.weight * jet.first;
    sum.second += term.weight * jet.second;
  }
  return sum;
}

Points KernelOperator::apply(const Points& x, const Points& y, const Points& p) const {
  check_sources(x, y, p);
  if (are_on_line(terms_, x, y))
    return line_sums(terms_, x.transpose(), y.transpose(), p.transpose()).value.transpose();
  return field_sum(PairSum::kApply, terms_, x, y, p, x.rows()).points(0, x.rows(), x.cols());
}

Points KernelOperator::apply_with_jacobian(const Points& x, const Points& y, const Points& p,
                                           Eigen::MatrixXd& jacobian) const {
  check_sources(x, y, p);
  if (are_on_line(terms_, x, y)) {
    const LineSums sums = line_sums(terms_, x.transpose(), y.transpose(), p.transpose());
    jacobian = sums.slope.transpose();
    return sums.value.transpose();
  }
  const Eigen::Index d = x.rows();
  const CoordinateRows sums = field_sum(PairSum::kApplyJacobian, terms_, x, y, p, d + d * d);
  jacobian = sums.points(d, d * d, x.cols());
  return sums.points(0, d, x.cols());
}

Points KernelOperator::apply_tangent(const Points& q, const Points& p, const Points& delta) const {
  check_vectors(q, p, delta);
  if (are_on_line(terms_, q, q)) {
    const LineSums sums = sums_along(terms_, q, (Points(2, q.cols()) << p, p.cwiseProduct(delta)).finished());
    return delta.cwiseProduct(sums.slope.col(0).transpose()) - sums.slope.col(1).transpose();
  }
  Points sum = Points::Zero(q.rows(), q.cols());
  add_self_sum(PairSum::kTangent, terms_, q, delta, delta, p, delta, all_columns(q), nonzero_columns(p), sum);
  return sum;
}

// Landmarks without momentum act on those with momentum alone, through a.
Points KernelOperator::gradient(const Points& q, const Points& a, const Points& p) const {
  check_vectors(q, p, a);
  if (are_on_line(terms_, q, q)) {
    const LineSums sums = sums_along(terms_, q, (Points(2, q.cols()) << p, a).finished());
    return a.cwiseProduct(sums.slope.col(0).transpose()) + p.cwiseProduct(sums.slope.col(1).transpose());
  }
  Points sum = Points::Zero(q.rows(), q.cols());
  const Indices moving = nonzero_columns(p);
  add_self_sum(PairSum::kGradient, terms_, q, a, p, a, p, all_columns(q), moving, sum);
  if (static_cast<Eigen::Index>(moving.size()) < q.cols())
    add_self_sum(PairSum::kGradient, terms_, q, a, p, a, p, moving, complement(moving, q.cols()), sum);
  return sum;
}

Points KernelOperator::hessian(const Points& q, const Points& p, const Points& delta) const {
  check_vectors(q, p, delta);
  if (are_on_line(terms_, q, q)) {
    const LineSums sums = sums_along(terms_, q, (Points(2, q.cols()) << p, p.cwiseProduct(delta)).finished());
    return p.cwiseProduct(delta.cwiseProduct(sums.second.col(0).transpose()) - sums.second.col(1).transpose());
  }
  Points sum = Points::Zero(q.rows(), q.cols());
  const Indices moving = nonzero_columns(p);
  add_self_sum(PairSum::kHessian, terms_, q, delta, p, p, delta, moving, moving, sum);
  return sum;
}

// Landmarks without momentum add nothing, and feel no force.
Flow KernelOperator::flow(const Points& q, const Points& p) const {
  check_sources(q, q, p);
  if (are_on_line(terms_, q, q)) {
    const LineSums sums = sums_along(terms_, q, p);
    return {sums.value.transpose(), p.cwiseProduct(sums.slope.transpose())};
  }
  const Eigen::Index d = q.rows();
  const Indices moving = nonzero_columns(p);
  const Points at = part(q, moving), momenta = part(p, moving);
  if (std::ssize(moving) == q.cols()) {
    const CoordinateRows sums = pair_sum(PairSum::kFlow, terms_, q, nullptr, &p, at, momenta, nullptr, 2 * d);
    return {sums.points(0, d, q.cols()), sums.points(d, d, q.cols())};
  }
  Flow flow{Points::Zero(d, q.cols()), Points::Zero(d, q.cols())};
  if (moving.empty()) return flow;
  const CoordinateRows sums = pair_sum(PairSum::kFlow, terms_, at, nullptr, &momenta, at, momenta, nullptr, 2 * d);
  flow.velocity(Eigen::all, moving) = sums.points(0, d, at.cols());
  flow.force(Eigen::all, moving) = sums.points(d, d, at.cols());
  const Indices still = complement(moving, q.cols());
  flow.velocity(Eigen::all, still) = apply(part(q, still), at, momenta);
  return flow;
}

Flow KernelOperator::flow_tangent(const Points& q, const Points& p, const Points& dq, const Points& dp) const {
  check_vectors(q, p, dq);
  require_size("the change of the momenta of a kernel sum", dp, q.rows(), q.cols());
  if (are_on_line(terms_, q, q)) {
    const LineSums sums = sums_along(terms_, q, (Points(3, q.cols()) << p, p.cwiseProduct(dq), dp).finished());
    const auto row = [](const Eigen::MatrixXd& of, int column) -> Points { return of.col(column).transpose(); };
    return {row(sums.value, 2) + dq.cwiseProduct(row(sums.slope, 0)) - row(sums.slope, 1),
            p.cwiseProduct(dq.cwiseProduct(row(sums.second, 0)) - row(sums.second, 1)) +
                dp.cwiseProduct(row(sums.slope, 0)) + p.cwiseProduct(row(sums.slope, 2))};
  }
  const Eigen::Index d = q.rows();
  const Indices moving = nonzero_columns(p.cwiseAbs() + dp.cwiseAbs());
  const Points b = part(dq, moving), c = part(dp, moving);
  const CoordinateRows sums =
      pair_sum(PairSum::kFlowTangent, terms_, q, &dq, &p, part(q, moving), part(p, moving), &b, 2 * d, &dp, &c);
  return {sums.points(0, d, q.cols()), sums.points(d, d, q.cols())};
}

Eigen::MatrixXd KernelOperator::gram(const Points& x, const Points& y) const {
  check_sources(x, y, y);
  if (has_own(terms_)) return plain_gram(terms_, x, y);
  const CoordinateRows targets(x), sources(y);
  CoordinateRows unit(sources.stride(), x.rows());  // the first coordinate of all sources is 1
  std::fill_n(unit.data(), sources.stride(), 1.0);
  Eigen::MatrixXd matrix(x.cols(), y.cols());
  for (Eigen::Index j = 0; j < y.cols(); ++j) {
    CoordinateRows column(targets.stride(), x.rows());
    PairSumArguments arguments{.sum = PairSum::kApply,
                               .dimension = static_cast<int>(x.rows()),
                               .term = {},
                               .targets = static_cast<std::size_t>(x.cols()),
                               .sources = 1,
                               .target_stride = targets.stride(),
                               .source_stride = sources.stride(),
                               .x = targets.data(),
                               .y = sources.data() + j,
                               .a = unit.data(),
                               .out = column.data()};
    run(arguments, terms_);
    matrix.col(j) = Eigen::Map<const Eigen::VectorXd>(column.data(), x.cols());
  }
  return matrix;
}

}  // namespace pulson
