#include "pulson/core/alignment.hpp"

#include <limits>

#include <Eigen/LU>
#include <Eigen/QR>
#include <Eigen/SVD>
#include <fmt/core.h>

#include "core/determined.hpp"
#include "core/nearest_rotation.hpp"
#include "core/text.hpp"
#include "landmark_pairs.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr EnumNames<AlignmentKind, 5> kAlignmentNames = {"alignment",
                                                         {{{"none", AlignmentKind::kNone},
                                                           {"translation", AlignmentKind::kTranslation},
                                                           {"rigid", AlignmentKind::kRigid},
                                                           {"similarity", AlignmentKind::kSimilarity},
                                                           {"affine", AlignmentKind::kAffine}}}};

// What is below this part of the size of its terms is their rounding.
constexpr double kRounding = 1e-12;

// The landmarks of a shape that the fit uses, M of them.
struct WeighedShape {
  VectorXd mean;      // x̄, weighted
  Points points;      // d×M, √w_a (x_a − x̄)
  double resolution;  // below which a length in `points` is rounding of the coordinates

  WeighedShape(const Points& x, const VectorXd& weights) : mean(x * weights / weights.sum()) {
    const VectorXd roots = weights.cwiseSqrt();
    points = (x.colwise() - mean) * roots.asDiagonal();
    resolution = kRounding * (x * roots.asDiagonal()).norm();
  }

  bool is_one_place() const { return points.norm() <= resolution; }
};

// Those of positive weight and finite coordinates.
std::vector<Index> usable_landmarks(const Points& source, const Points& target, const VectorXd& weights) {
  std::vector<Index> usable;
  for (Index a = 0; a < source.cols(); ++a)
    if (weights[a] > 0 && source.col(a).allFinite() && target.col(a).allFinite()) usable.push_back(a);
  if (usable.empty())
    throw InputError("no landmark can be aligned: none has finite coordinates in both shapes and a weight above 0");
  return usable;
}

// A rotation, unless a reflection may be taken and fits better. Where the shapes lie in a hyperplane, both fit alike.
MatrixXd orthogonal_fit(const WeighedShape& x, const WeighedShape& y, bool reflect) {
  const double resolution = x.points.norm() * y.resolution + y.points.norm() * x.resolution;
  return nearest_orthogonal(y.points * x.points.transpose(),
                            reflect ? resolution : std::numeric_limits<double>::infinity());
}

// Below this correlation shapes have nothing to do with each other.
constexpr double kRelated = 0.5;

// The s > 0 of least |sx − y|². For unrelated shapes, such as a line and its reverse, that is one that shrinks the
// source to a point, as the mean is nearest to everything; and every default is a part of its size. Theirs is then the
// ratio of the spreads.
double scale_fit(const Points& x, const Points& y) {
  const double fitted = x.cwiseProduct(y).sum() / x.squaredNorm();
  const double of_spreads = y.norm() / x.norm();
  return fitted > kRelated * of_spreads ? fitted : of_spreads;
}

// Whether the columns span the space, beyond `resolution`.
bool span_space(const MatrixXd& columns, double resolution) {
  return columns.cols() >= columns.rows() &&
         Eigen::JacobiSVD<MatrixXd>(columns).singularValues().minCoeff() > resolution;
}

void check_general_position(const WeighedShape& shape, std::string_view name) {
  if (span_space(shape.points, shape.resolution)) return;
  const Index d = shape.points.rows();
  throw InputError(fmt::format(
      "an affine alignment in {}D needs at least {} landmarks in general position, with a weight above 0 and finite "
      "coordinates in both shapes; of the {} there are {}{}",
      d, d + 1, name, shape.points.cols(), shape.points.cols() > d ? ", all in one hyperplane" : ""));
}

// The regular A of least |Ax − y|².
MatrixXd affine_fit(const WeighedShape& x, const WeighedShape& y, bool reflect) {
  check_general_position(x, "source");
  check_general_position(y, "target");
  MatrixXd fitted = x.points.transpose().colPivHouseholderQr().solve(y.points.transpose()).transpose();
  if (!span_space(fitted, kRounding * fitted.norm()))
    throw InputError("the affine fit has determinant 0: it flattens the shape");
  const double determinant = fitted.determinant();
  if (determinant < 0 && !reflect)
    throw InputError(fmt::format(
        "the affine fit has determinant {:.4g}, not a positive one: it mirrors the shape; `reflect` allows that",
        determinant));
  return fitted;
}

// The change of each point by a turn in the plane of two axes.
Points turned(const Points& points, Index first, Index second) {
  Points change = Points::Zero(points.rows(), points.cols());
  change.row(first) = -points.row(second);
  change.row(second) = points.row(first);
  return change;
}

}  // namespace

SmallMatrix nearest_orthogonal(const SmallMatrix& products, double reflection) {
  const Eigen::JacobiSVD<SmallMatrix> svd(products, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Index last = svd.singularValues().size() - 1;
  VectorXd sign = VectorXd::Ones(last + 1);
  if (!(svd.singularValues()[last] > reflection) && (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0)
    sign[last] = -1;
  return svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
}

Points Alignment::apply(const Points& x) const {
  require_size("the points of an alignment", x, linear.cols(), x.cols());
  return (scale * linear * x).colwise() + translation;
}

AlignmentKind parse_alignment(std::string_view name) { return kAlignmentNames.parse(name); }

std::string alignment_name(AlignmentKind kind) { return kAlignmentNames.name(kind); }

Alignment align(const Points& source, const Points& target, AlignmentKind kind, const AlignmentOptions& options) {
  const SerialBlas serial;
  const Index d = source.rows();
  Alignment motion{kind, 1, MatrixXd::Identity(d, d), VectorXd::Zero(d)};
  require_size("the target of an alignment", target, d, source.cols());
  if (kind == AlignmentKind::kNone) return motion;
  const VectorXd weights = landmark_weights(options.weights, source.cols());
  const std::vector<Index> usable = usable_landmarks(source, target, weights);
  const VectorXd relative = weights(usable) / weights(usable).maxCoeff();
  const WeighedShape x(source(Eigen::all, usable), relative);
  const WeighedShape y(target(Eigen::all, usable), relative);
  if (kind == AlignmentKind::kAffine) {
    motion.linear = affine_fit(x, y, options.reflect);
  } else if (kind != AlignmentKind::kTranslation && !x.is_one_place() && !y.is_one_place()) {
    motion.linear = orthogonal_fit(x, y, options.reflect);
    if (kind == AlignmentKind::kSimilarity) motion.scale = scale_fit(motion.linear * x.points, y.points);
  }
  motion.translation = y.mean - motion.scale * motion.linear * x.mean;
  return motion;
}

Index alignment_parameters(AlignmentKind kind, Index d) {
  if (kind == AlignmentKind::kNone) return 0;
  if (kind == AlignmentKind::kTranslation) return d;
  if (kind == AlignmentKind::kAffine) return d * (d + 1);
  return d * (d + 1) / 2 + (kind == AlignmentKind::kSimilarity ? 1 : 0);
}

bool is_determined(const Points& source, const Points& target, AlignmentKind kind, const VectorXd& weights) {
  require_size("the target of an alignment", target, source.rows(), source.cols());
  if (kind == AlignmentKind::kNone) return true;
  const auto observed = std::ssize(usable_landmarks(source, target, landmark_weights(weights, source.cols())));
  return source.rows() * observed > alignment_parameters(kind, source.rows());
}

double part_of_pose(const Points& source, const std::vector<Landmarks>& shapes) {
  const auto squares = [](const Points& off) { return off.array().isFinite().select(off.array(), 0).square().sum(); };
  double all = 0, left = 0;
  for (const Landmarks& shape : shapes) {
    if (!is_determined(source, shape.points, AlignmentKind::kSimilarity)) continue;
    all += squares(source - shape.points);
    left += squares(align(source, shape.points, AlignmentKind::kSimilarity).apply(source) - shape.points);
  }
  return all > 0 ? 1 - left / all : 0;
}

void require_determined(const Points& source, const Points& target, AlignmentKind kind, std::string_view shape,
                        const VectorXd& weights) {
  if (is_determined(source, target, kind, weights)) return;
  const Index d = source.rows();
  const auto observed = usable_landmarks(source, target, landmark_weights(weights, source.cols())).size();
  const bool translation_does =
      kind != AlignmentKind::kTranslation && is_determined(source, target, AlignmentKind::kTranslation, weights);
  throw InputError(fmt::format(
      "{}: the match is undetermined: alignment {} has {} in {}D, no fewer than the {} of the {} observed in both "
      "shapes; use `align = {}`",
      shape, alignment_name(kind), text::counted(static_cast<std::size_t>(alignment_parameters(kind, d)), "parameter"),
      d, text::counted(observed * static_cast<std::size_t>(d), "coordinate"), text::counted(observed, "landmark"),
      translation_does ? "translation" : "none"));
}

MatrixXd motion_directions(const Points& points, AlignmentKind kind, const std::vector<Index>& observed) {
  const Points shape = points.colwise() - points.rowwise().mean();
  const Index d = shape.rows();
  std::vector<VectorXd> changes;
  const auto add = [&](const Points& change) { changes.emplace_back(change.reshaped()(observed)); };
  if (kind != AlignmentKind::kNone)
    for (Index axis = 0; axis < d; ++axis) {
      Points shift = Points::Zero(d, shape.cols());
      shift.row(axis).setOnes();
      add(shift);
    }
  if (kind == AlignmentKind::kRigid || kind == AlignmentKind::kSimilarity)
    for (Index second = 1; second < d; ++second)
      for (Index first = 0; first < second; ++first) add(turned(shape, first, second));
  if (kind == AlignmentKind::kSimilarity) add(shape);
  if (kind == AlignmentKind::kAffine)
    for (Index to = 0; to < d; ++to)
      for (Index from = 0; from < d; ++from) {
        Points sheared = Points::Zero(d, shape.cols());
        sheared.row(to) = shape.row(from);
        add(sheared);
      }
  MatrixXd directions(std::ssize(observed), std::ssize(changes));
  if (changes.empty()) return directions;
  for (Index i = 0; i < directions.cols(); ++i) directions.col(i) = changes[static_cast<std::size_t>(i)];
  const Eigen::ColPivHouseholderQR<MatrixXd> factors(directions);
  MatrixXd basis = MatrixXd::Identity(directions.rows(), factors.rank());
  basis.applyOnTheLeft(factors.householderQ());
  return basis;
}

}  // namespace pulson
