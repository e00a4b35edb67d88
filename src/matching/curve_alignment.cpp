#include "curve_alignment.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>
#include <ceres/gradient_problem.h>
#include <ceres/gradient_problem_solver.h>
#include <ceres/jet.h>
#include <ceres/product_manifold.h>
#include <fmt/core.h>

#include "pulson/core/errors.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// Widths of the first data term and the last, in diameters of the target. Finer ones see detail that the flow is to
// match, and have as many minima: two skulls, of which one is to be turned by 2 degrees and enlarged by 1.2, were
// turned by 18 and enlarged by 1.08 at a tenth.
constexpr double kWidestPart = 0.5, kFinestPart = 0.25;
constexpr Index kMostEdges = 200;        // of a curve in the searches from all starts; the last one takes every edge
constexpr int kAngles = 12;              // starts in the plane: within 15 degrees of any turn
constexpr double kSamePose = 0.02;       // root mean square distance of two images, in diameters of the target
constexpr double kClearlyLess = 0.999;   // cost of a start that is taken in place of one before it
constexpr double kPoseTolerance = 1e-9;  // change of D, over D: poses to some 1e-5 of the width

// By the lengths of edges.
struct CurveMoments {
  VectorXd centre;
  MatrixXd covariance;
};

CurveMoments moments_of(const Curve& curve) {
  const Index d = curve.points.rows();
  double length = 0;
  VectorXd sum = VectorXd::Zero(d);
  MatrixXd squares = MatrixXd::Zero(d, d);
  for (const auto& [a, b] : curve.edges) {
    const double edge = (curve.points.col(b) - curve.points.col(a)).norm();
    const VectorXd middle = 0.5 * (curve.points.col(a) + curve.points.col(b));
    length += edge;
    sum += edge * middle;
    squares += edge * middle * middle.transpose();
  }
  if (!(length > 0)) return {curve.points.rowwise().mean(), MatrixXd::Zero(d, d)};
  const VectorXd centre = sum / length;
  return {centre, squares / length - centre * centre.transpose()};
}

// The curve through every few of its vertices: consecutive edges become one.
Curve thinned(const Curve& curve) {
  const Index run = (std::ssize(curve.edges) + kMostEdges - 1) / kMostEdges;
  Curve few{curve.points, {}};
  Index joined = run;
  for (const auto& [a, b] : curve.edges) {
    const bool goes_on = joined < run && few.edges.back().second == a && few.edges.back().first != b;
    if (goes_on)
      few.edges.back().second = b;
    else
      few.edges.emplace_back(a, b);
    joined = goes_on ? joined + 1 : 1;
  }
  return few;
}

// x ↦ sR(x − c) + c' + unit·τ, with R a turn by an angle in the plane, of a quaternion in space. Its parameters are
// those of R, τ and, where it scales, log s.
template <int d>
class CurvePose {
 public:
  static constexpr int kTurn = d == 2 ? 1 : 4;
  using Matrix = Eigen::Matrix<double, d, d>;

  CurvePose(VectorXd from, VectorXd to, double unit, double size, bool scales)
      : from_(std::move(from)), to_(std::move(to)), unit_(unit), size_(size), scales_(scales) {}

  int parameters() const { return kTurn + d + (scales_ ? 1 : 0); }

  VectorXd start(const Matrix& turn) const {
    VectorXd pose = VectorXd::Zero(parameters());
    if constexpr (d == 2)
      pose[0] = Eigen::Rotation2Dd(turn).angle();
    else
      pose.head<4>() = Eigen::Quaterniond(turn).normalized().coeffs();
    return pose;
  }

  Alignment alignment(const VectorXd& pose) const {
    const double scale = scale_of(pose);
    const Matrix turn = rotation(pose.head<kTurn>().eval());
    return {scales_ ? AlignmentKind::kSimilarity : AlignmentKind::kRigid, scale, turn,
            to_ + unit_ * pose.segment<d>(kTurn) - scale * turn * from_};
  }

  Points image(const VectorXd& pose, const Points& x) const { return alignment(pose).apply(x); }

  // From the derivative by the image of x to that by the pose.
  VectorXd gradient(const VectorXd& pose, const Points& x, const Points& image_bar) const {
    using Jet = ceres::Jet<double, kTurn>;
    Eigen::Matrix<Jet, kTurn, 1> turn;
    for (int i = 0; i < kTurn; ++i) turn[i] = Jet(pose[i], i);
    const auto jets = rotation(turn);
    const Matrix by_rotation = scale_of(pose) * image_bar * (x.colwise() - from_).transpose();
    VectorXd bar = VectorXd::Zero(parameters());
    double by_log_scale = 0;
    for (int j = 0; j < d; ++j)
      for (int i = 0; i < d; ++i) {
        bar.head<kTurn>() += by_rotation(i, j) * jets(i, j).v;
        by_log_scale += by_rotation(i, j) * jets(i, j).a;
      }
    bar.segment<d>(kTurn) = unit_ * image_bar.rowwise().sum();
    if (scales_) bar[kTurn + d] = by_log_scale;
    return bar;
  }

  ceres::Manifold* manifold() const {
    using Others = ceres::EuclideanManifold<ceres::DYNAMIC>;
    if constexpr (d == 2)
      return new Others(parameters());
    else
      return new ceres::ProductManifold<ceres::EigenQuaternionManifold, Others>(ceres::EigenQuaternionManifold(),
                                                                                Others(parameters() - kTurn));
  }

 private:
  template <class T>
  static Eigen::Matrix<T, d, d> rotation(const Eigen::Matrix<T, kTurn, 1>& turn) {
    if constexpr (d == 2)
      return Eigen::Rotation2D<T>(turn[0]).toRotationMatrix();
    else
      return Eigen::Quaternion<T>(turn).toRotationMatrix();
  }

  double scale_of(const VectorXd& pose) const { return scales_ ? size_ * std::exp(pose[kTurn + d]) : 1; }

  VectorXd from_, to_;
  double unit_;  // length of τ = 1
  double size_;  // s where log s is 0
  bool scales_;
};

// D of the image of a curve.
template <int d>
class CurvePoseCost final : public ceres::FirstOrderFunction {
 public:
  CurvePoseCost(const CurvePose<d>& pose, const Curve& source, const Curve& target, const CurveTermOptions& options)
      : pose_(pose), source_(source.points), term_(source.edges, static_cast<int>(source_.cols()), target, options) {}

  bool Evaluate(const double* parameters, double* cost, double* gradient) const override {
    const VectorXd at = Eigen::Map<const VectorXd>(parameters, NumParameters());
    const Points image = pose_.image(at, source_);
    *cost = term_.value(image);
    if (gradient != nullptr)
      Eigen::Map<VectorXd>(gradient, NumParameters()) = pose_.gradient(at, source_, term_.gradient(image));
    return std::isfinite(*cost);
  }

  int NumParameters() const override { return pose_.parameters(); }

 private:
  const CurvePose<d>& pose_;
  Points source_;
  CurveTerm term_;
};

struct FoundPose {
  VectorXd pose;
  double cost = 0;
};

// The axes of a covariance, a rotation.
template <int d>
Eigen::Matrix<double, d, d> principal_axes(const MatrixXd& covariance) {
  Eigen::Matrix<double, d, d> axes = Eigen::SelfAdjointEigenSolver<MatrixXd>(covariance).eigenvectors();
  if (axes.determinant() < 0) axes.col(0) *= -1;
  return axes;
}

// The rotations that take axes to axes, of either sign: 2 in the plane and 4 in space.
template <int d>
std::vector<Eigen::Matrix<double, d, d>> axis_turns(const MatrixXd& source, const MatrixXd& target) {
  const auto from = principal_axes<d>(source), to = principal_axes<d>(target);
  std::vector<Eigen::Matrix<double, d, d>> turns;
  for (int signs = 0; signs < (1 << d); ++signs) {
    Eigen::Matrix<double, d, 1> sign;
    for (int axis = 0; axis < d; ++axis) sign[axis] = (signs >> axis) % 2 == 0 ? 1 : -1;
    if (sign.prod() > 0) turns.push_back(to * sign.asDiagonal() * from.transpose());
  }
  return turns;
}

// No turn, then turns all around: by equal angles, or those of the cube.
template <int d>
std::vector<Eigen::Matrix<double, d, d>> turns_around() {
  std::vector<Eigen::Matrix<double, d, d>> turns;
  if constexpr (d == 2) {
    for (int i = 0; i < kAngles; ++i)
      turns.push_back(Eigen::Rotation2Dd(2 * std::numbers::pi * i / kAngles).toRotationMatrix());
  } else {
    std::vector<int> order = {0, 1, 2};
    do {
      for (int signs = 0; signs < 8; ++signs) {
        Eigen::Matrix3d turn = Eigen::Matrix3d::Zero();
        for (int i = 0; i < 3; ++i) turn(order[static_cast<std::size_t>(i)], i) = (signs >> i) % 2 == 0 ? 1 : -1;
        if (turn.determinant() > 0) turns.push_back(turn);
      }
    } while (std::next_permutation(order.begin(), order.end()));
  }
  return turns;
}

template <int d>
class CurvePoseSearch {
 public:
  using Matrix = Eigen::Matrix<double, d, d>;

  CurvePoseSearch(const Curve& source, const Curve& target, bool scales, const CurveAlignmentOptions& options)
      : source_(source),
        target_(target),
        options_(options),
        unit_(diameter(target.points)),
        from_(moments_of(source)),
        to_(moments_of(target)),
        pose_(from_.centre, to_.centre, unit_, start_scale(), scales) {}

  FoundPose run() const {
    const Curve few = thinned(source_), few_of_target = thinned(target_);
    const double finest = std::max(kFinestPart * unit_, options_.width);
    const double widest = std::max(kWidestPart * unit_, finest);
    std::vector<FoundPose> found;
    for (const VectorXd& start : starts()) {
      const VectorXd pose = minimum(start, few, few_of_target, widest).pose;
      const auto is_same = [&](const FoundPose& other) { return same(other.pose, pose); };
      if (std::none_of(found.begin(), found.end(), is_same)) found.push_back({pose, 0});
    }
    for (FoundPose& each : found) each = minimum(each.pose, few, few_of_target, finest);
    const FoundPose* best = &found.front();
    for (const FoundPose& each : found)
      if (each.cost < kClearlyLess * best->cost) best = &each;
    return minimum(best->pose, source_, target_, finest);
  }

  Alignment alignment(const FoundPose& found) const { return pose_.alignment(found.pose); }

 private:
  double start_scale() const {
    const double from = from_.covariance.trace(), to = to_.covariance.trace();
    return from > 0 && to > 0 ? std::sqrt(to / from) : 1;
  }

  std::vector<VectorXd> starts() const {
    std::vector<Matrix> turns = turns_around<d>();
    for (const Matrix& turn : axis_turns<d>(from_.covariance, to_.covariance)) turns.push_back(turn);
    std::vector<VectorXd> poses;
    for (const Matrix& turn : turns) poses.push_back(pose_.start(turn));
    return poses;
  }

  bool same(const VectorXd& first, const VectorXd& second) const {
    const Points apart = pose_.image(first, source_.points) - pose_.image(second, source_.points);
    return apart.norm() <= kSamePose * unit_ * std::sqrt(static_cast<double>(apart.cols()));
  }

  FoundPose minimum(VectorXd pose, const Curve& source, const Curve& target, double width) const {
    // A translation by δ then costs some |δ/unit|²: the parameters have derivatives of like size.
    const double sigma = unit_ * std::sqrt(static_cast<double>(source.points.cols()));
    ceres::GradientProblemSolver::Options how;
    how.logging_type = ceres::SILENT;
    how.function_tolerance = kPoseTolerance;
    how.max_num_iterations = 100;
    auto* cost = new CurvePoseCost<d>(pose_, source, target, {options_.measure, sigma, width});
    const ceres::GradientProblem problem(cost, pose_.manifold());  // owns both
    ceres::GradientProblemSolver::Summary summary;
    ceres::Solve(how, problem, pose.data(), &summary);
    double value = 0;
    cost->Evaluate(pose.data(), &value, nullptr);
    return {std::move(pose), value};
  }

  const Curve &source_, &target_;
  const CurveAlignmentOptions& options_;
  double unit_;
  CurveMoments from_, to_;
  CurvePose<d> pose_;
};

template <int d>
Alignment best_pose(const Curve& source, const Curve& target, bool scales, const CurveAlignmentOptions& options) {
  const CurvePoseSearch<d> search(source, target, scales, options);
  const FoundPose found = search.run();
  if (!options.reflect) return search.alignment(found);
  Curve flipped = source;
  flipped.points.row(0) *= -1;
  const CurvePoseSearch<d> other(flipped, target, scales, options);
  const FoundPose mirrored = other.run();
  if (!(mirrored.cost < kClearlyLess * found.cost)) return search.alignment(found);
  Alignment alignment = other.alignment(mirrored);
  alignment.linear.col(0) *= -1;
  return alignment;
}

}  // namespace

Alignment align_curves(const Curve& source, const Curve& target, AlignmentKind kind,
                       const CurveAlignmentOptions& options) {
  const Index d = source.points.rows();
  Alignment motion{kind, 1, MatrixXd::Identity(d, d), VectorXd::Zero(d)};
  if (kind == AlignmentKind::kNone) return motion;
  if (kind == AlignmentKind::kAffine)
    throw InputError("alignment affine needs corresponding landmarks; curves can be aligned by similarity");
  const bool scales = kind == AlignmentKind::kSimilarity;
  if (kind == AlignmentKind::kTranslation)
    motion.translation = moments_of(target).centre - moments_of(source).centre;
  else
    motion = d == 2 ? best_pose<2>(source, target, scales, options) : best_pose<3>(source, target, scales, options);
  return motion;
}

}  // namespace pulson::matching
