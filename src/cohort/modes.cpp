// Principal components, of momenta and of Procrustes coordinates.

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/factorisations.hpp"
#include "pulson/cohort/statistics.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kVanishing = 1e-12;  // of the largest eigenvalue
constexpr int kMostRounds = 1000;
constexpr double kMeanChange = 1e-15;  // change of the mean, squared, which ends the rounds

MatrixXd as_columns(const std::vector<Points>& shapes) {
  MatrixXd columns(shapes.front().size(), static_cast<Index>(shapes.size()));
  for (std::size_t i = 0; i < shapes.size(); ++i) columns.col(static_cast<Index>(i)) = shapes[i].reshaped();
  return columns;
}

// Of each column with the columns of `metric` on the axes of each landmark: (metric ⊗ I) columns.
MatrixXd times_metric(const MatrixXd& columns, const MatrixXd& metric) {
  MatrixXd result(columns.rows(), columns.cols());
  const Index n = metric.cols();
  for (Index i = 0; i < columns.cols(); ++i)
    result.col(i) = (columns.col(i).reshaped(columns.rows() / n, n) * metric).reshaped();
  return result;
}

// The eigenvectors of a symmetric matrix, of the largest values first, and how many are not 0 within rounding.
struct Spectrum {
  VectorXd values;
  MatrixXd vectors;

  explicit Spectrum(const MatrixXd& matrix, Index most) {
    const Eigen::SelfAdjointEigenSolver<MatrixXd> factors(matrix);
    values = factors.eigenvalues().reverse();
    vectors = factors.eigenvectors().rowwise().reverse();
    Index rank = 0;
    while (rank < std::min(most, values.size()) && values[rank] > kVanishing * values[0]) ++rank;
    values.conservativeResize(rank);
    vectors.conservativeResize(Eigen::NoChange, rank);
  }
};

void make_signs_unique(ShapeModes& modes) {
  for (std::size_t k = 0; k < modes.directions.size(); ++k) {
    Points& direction = modes.directions[k];
    Index row = 0, column = 0;
    direction.cwiseAbs().maxCoeff(&row, &column);
    if (direction(row, column) > 0) continue;
    direction = -direction;
    modes.scores.col(static_cast<Index>(k)) *= -1;
  }
}

// Of columns in the inner product of a metric N×N on each axis.
ShapeModes principal_components(MatrixXd columns, const MatrixXd& metric, Index dimension) {
  const Index n = columns.cols();
  columns.colwise() -= columns.rowwise().mean().eval();
  const auto denominator = static_cast<double>(n - 1);
  ShapeModes modes;
  MatrixXd directions;
  if (n <= columns.rows()) {  // by specimens
    const Spectrum spectrum(columns.transpose() * times_metric(columns, metric) / denominator, n - 1);
    modes.eigenvalues = spectrum.values;
    const VectorXd lengths = (denominator * spectrum.values).cwiseSqrt();
    modes.scores = spectrum.vectors * lengths.asDiagonal();
    directions = columns * spectrum.vectors * lengths.cwiseInverse().asDiagonal();
  } else {  // by coordinates: with the symmetric root R of the metric, the components of R·columns
    const Eigen::SelfAdjointEigenSolver<MatrixXd> factors(metric);
    const VectorXd roots = factors.eigenvalues().cwiseMax(0).cwiseSqrt();
    const MatrixXd root = factors.eigenvectors() * roots.asDiagonal() * factors.eigenvectors().transpose();
    const MatrixXd whitened = times_metric(columns, root);
    const Spectrum spectrum(whitened * whitened.transpose() / denominator, n - 1);
    modes.eigenvalues = spectrum.values;
    modes.scores = whitened.transpose() * spectrum.vectors;
    // Momenta in the span of those observed: p = columns·w with R p = the eigenvector.
    directions = columns * modes.scores * (denominator * spectrum.values).cwiseInverse().asDiagonal();
  }
  for (const auto& direction : directions.colwise())
    modes.directions.emplace_back(direction.reshaped(dimension, metric.cols()));
  make_signs_unique(modes);
  return modes;
}

Points of_unit_size(const Points& points) {
  const Points centred = points.colwise() - points.rowwise().mean();
  return centred / centred.norm();
}

// The rotation of the one, about the origin, that brings it closest to the other.
Points turned_onto(const Points& points, const Points& target) {
  Alignment turn = align(points, target, AlignmentKind::kRigid);
  return turn.linear * points;
}

// Landmarks that all shapes have.
std::vector<int> common_landmarks(const std::vector<Points>& shapes) {
  std::vector<int> common;
  for (Eigen::Index a = 0; a < shapes.front().cols(); ++a)
    if (std::all_of(shapes.begin(), shapes.end(), [a](const Points& shape) { return shape.col(a).allFinite(); }))
      common.push_back(static_cast<int>(a));
  if (const auto count = std::ssize(common); count <= shapes.front().rows())
    throw InputError(
        fmt::format("only {} in all specimens, too few for Procrustes coordinates: leave specimens out "
                    "that lack others",
                    count == 1 ? "1 landmark is" : fmt::format("{} landmarks are", count)));
  return common;
}

}  // namespace

ShapeModes momentum_modes(const Atlas& atlas) {
  const SerialBlas serial;
  std::vector<Points> momenta;
  for (const AtlasSpecimen& specimen : atlas.specimens) momenta.push_back(specimen.momenta);
  return principal_components(as_columns(momenta), atlas.metric(), atlas.mean.points.rows());
}

ProcrustesModes procrustes_modes(const std::vector<Points>& shapes) {
  const SerialBlas serial;
  if (shapes.size() < 2) throw InputError("principal components need at least two shapes");
  const std::vector<int> common = common_landmarks(shapes);
  std::vector<Points> moved;
  for (const Points& shape : shapes) moved.push_back(of_unit_size(shape(Eigen::all, common)));
  Points mean = moved.front();
  for (int round = 0; round < kMostRounds; ++round) {
    Points sum = Points::Zero(mean.rows(), mean.cols());
    for (Points& shape : moved) {
      shape = turned_onto(shape, mean);
      sum += shape;
    }
    const Points next = of_unit_size(sum);
    const double change = (next - mean).squaredNorm();
    mean = next;
    if (change < kMeanChange * kMeanChange) break;
  }
  // The mean as the first shape lies.
  const Alignment back = align(mean, of_unit_size(shapes.front()(Eigen::all, common)), AlignmentKind::kRigid);
  mean = back.linear * mean;
  for (Points& shape : moved) {
    shape = back.linear * shape;
    shape -= shape.cwiseProduct(mean).sum() * mean;
  }
  return {mean, principal_components(as_columns(moved), MatrixXd::Identity(mean.cols(), mean.cols()), mean.rows()),
          common};
}

}  // namespace pulson::cohort
