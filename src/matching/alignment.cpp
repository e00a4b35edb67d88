#include "pulson/matching/alignment.hpp"

#include <array>
#include <utility>

#include <Eigen/LU>
#include <Eigen/SVD>

#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

constexpr std::array<std::pair<std::string_view, AlignmentKind>, 4> kNames = {
    {{"none", AlignmentKind::kNone},
     {"translation", AlignmentKind::kTranslation},
     {"rigid", AlignmentKind::kRigid},
     {"similarity", AlignmentKind::kSimilarity}}};

}  // namespace

Points Alignment::apply(const Points& x) const { return (scale * rotation * x).colwise() + translation; }

AlignmentKind parse_alignment(std::string_view name) {
  std::string valid;
  for (const auto& [known, kind] : kNames) {
    if (known == name) return kind;
    valid += (valid.empty() ? "" : ", ") + std::string(known);
  }
  throw InputError("unknown alignment '" + std::string(name) + "'; valid: " + valid);
}

std::string alignment_name(AlignmentKind kind) {
  for (const auto& [name, known] : kNames)
    if (known == kind) return std::string(name);
  return {};
}

Alignment align(const Points& source, const Points& target, AlignmentKind kind) {
  const Eigen::Index d = source.rows();
  Alignment motion{kind, 1, Eigen::MatrixXd::Identity(d, d), Eigen::VectorXd::Zero(d)};
  if (kind == AlignmentKind::kNone) return motion;
  const Eigen::VectorXd source_mean = source.rowwise().mean();
  const Eigen::VectorXd target_mean = target.rowwise().mean();
  if (kind != AlignmentKind::kTranslation) {
    const Points x = source.colwise() - source_mean;
    const Points y = target.colwise() - target_mean;
    const Eigen::JacobiSVD<Eigen::MatrixXd> svd(y * x.transpose(), Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::VectorXd sign = Eigen::VectorXd::Ones(d);
    if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) sign[d - 1] = -1;
    motion.rotation = svd.matrixU() * sign.asDiagonal() * svd.matrixV().transpose();
    // Points all at one place have no size. On a line a reversal leaves no positive scale (the best is a reflection):
    // the size is then taken from the spreads.
    if (kind == AlignmentKind::kSimilarity && x.squaredNorm() > 0 && y.squaredNorm() > 0) {
      const double fitted = svd.singularValues().dot(sign) / x.squaredNorm();
      motion.scale = fitted > 0 ? fitted : y.norm() / x.norm();
    }
  }
  motion.translation = target_mean - motion.scale * motion.rotation * source_mean;
  return motion;
}

}  // namespace pulson
