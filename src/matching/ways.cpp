#include "ways.hpp"

#include <cmath>

#include <Eigen/Eigenvalues>
#include <Eigen/Geometry>

#include "pulson/random/normals.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kWaves = 4;

MatrixXd quarter_turn(const Points& centred, double sign) {
  MatrixXd turn(centred.rows(), centred.rows());
  if (centred.rows() == 2) {
    turn << 0, -sign, sign, 0;
    return turn;
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(Eigen::Matrix3d(centred * centred.transpose()));
  const Eigen::Vector3d axis = axes.eigenvectors().col(0);
  return Eigen::AngleAxisd(sign * std::acos(0.0), axis).toRotationMatrix();
}

// A sum of waves whose lengths are about a diameter.
Points random_field(const Points& x, double size, std::uint64_t seed, int index) {
  const Index d = x.rows();
  const MatrixXd numbers =
      standard_normals(seed, static_cast<std::uint64_t>(index), static_cast<int>(2 * d + 1), kWaves);
  Points field = Points::Zero(d, x.cols());
  for (int wave = 0; wave < kWaves; ++wave) {
    const VectorXd direction = numbers.col(wave).head(d);
    const VectorXd amplitude = numbers.col(wave).segment(d, d);
    const double phase = 3 * numbers(2 * d, wave);
    field += amplitude * ((3 / size) * (direction.transpose() * x).array() + phase).cos().matrix();
  }
  return (0.5 * size / std::sqrt(kWaves)) * field;
}

}  // namespace

Points halfway(const Points& source, const Points& target, int index, std::uint64_t seed) {
  const Points middle = 0.5 * (source + target);
  if (source.rows() == 1 || index > 2) return middle + random_field(middle, diameter(source), seed, index);
  // Turned where it is between the two, the shape would be crushed if they are turned by half: so the source is turned.
  const VectorXd centre = source.rowwise().mean();
  const Points centred = source.colwise() - centre;
  const Points turned = quarter_turn(centred, index == 1 ? 1 : -1) * centred;
  return turned.colwise() + VectorXd(0.5 * (centre + target.rowwise().mean()));
}

}  // namespace pulson
