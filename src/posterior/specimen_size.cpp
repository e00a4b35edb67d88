// The size that an alignment takes out of a specimen's data: the last part of its residual.

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

#include "linear_model.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/matching/data_term.hpp"
#include "shot_batch.hpp"
#include "size_exponent.hpp"

namespace pulson::posterior {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

// Those of 1: a number, or d² of a matrix.
VectorXd unit_size(Index numbers) {
  const auto d = static_cast<Index>(std::lround(std::sqrt(static_cast<double>(numbers))));
  return MatrixXd::Identity(d, d).reshaped();
}

}  // namespace

Specimen::OfSize Specimen::of_size(const Model& model) const {
  const double exponent = model.size_exponent / (sizes_ > 1 ? static_cast<double>(problem_.source.rows()) : 1);
  const double precision = std::max(exponent, 1.0);
  return {precision, 1 + exponent / precision};
}

VectorXd Specimen::centre_of_size(const Model& model) const { return of_size(model).centre * unit_size(sizes_); }

double Specimen::half_square_at_one(const Model& model) const {
  if (sizes_ == 0) return 0;
  const auto [k, c] = of_size(model);
  return 0.5 * k * std::pow(c - 1, 2) * unit_size(sizes_).squaredNorm();
}

VectorXd Specimen::units(const Model& model) const {
  VectorXd units = VectorXd::Constant(count_, model.sigma);
  if (sizes_ > 0) units.tail(sizes_).setConstant(1 / std::sqrt(of_size(model).precision));
  return units;
}

double Specimen::size_excess(const Model& model, const VectorXd& residual) const {
  if (sizes_ == 0) return 0;
  return 0.5 * residual.tail(sizes_).squaredNorm() - half_square_at_one(model);
}

double Specimen::log_likelihood(const Model& model, const VectorXd& residual) const {
  return size_excess(model, residual) - 0.5 * residual.squaredNorm() - log_volume(model);
}

Specimen Specimen::at_source() const {
  matching::MatchingProblem problem = problem_;
  problem.data =
      std::make_shared<matching::LandmarkTerm>(matching::LandmarkObservations{problem.source, problem.sigma, {}, {}});
  return {std::move(problem), pose_kind_};
}

SizeExponent::SizeExponent(const Specimen& specimen, const Specimen::Model& model)
    : coordinates_(specimen.coordinates()) {
  if (specimen.sizes_ > 0) at_rest_.emplace(specimen.at_source(), model);
}

// By the models linear about two paths on which the shape is that of the source and its size is not.
double SizeExponent::at(const Specimen::Model& of_specimen) const {
  constexpr double kAside = 0.02;  // of the size
  if (!at_rest_) return 0;
  Specimen::Model model = of_specimen;
  model.size_exponent = 0;
  const Specimen& specimen = at_rest_->specimen();
  const ShotBatch shots(specimen, model);
  const Index m = specimen.coordinates();
  const VectorXd units = specimen.units(model), one = unit_size(specimen.sizes_);
  std::shared_ptr<const LinearModel> about_rest;
  try {
    about_rest = at_rest_->at(model);
  } catch (const NumericalError&) {
    return 0;
  }
  const LinearAt linear(*about_rest, model);
  // z of least norm and misfit for a size: of S without the error of r_B.
  MatrixXd covariance = linear.gram();
  covariance.diagonal().head(m).array() += 1;
  VectorXd wanted = VectorXd::Zero(specimen.data());
  wanted.tail(specimen.sizes_) = kAside * one.cwiseQuotient(units.tail(specimen.sizes_));
  const VectorXd along = linear.transposed(covariance.ldlt().solve(wanted));
  MatrixXd z(specimen.unknowns(), 2);
  z << -along, along;
  const ShotBatch::Ends ends = shots.ends(z);
  std::vector<Specimen::Slopes> slopes = shots.slopes(z);
  double change = 0, size = 0;
  for (const Index l : {0, 1}) {
    Specimen::Slopes& of_path = slopes[static_cast<std::size_t>(l)];
    if (!ends.found[static_cast<std::size_t>(l)] || of_path.branches.empty()) return 0;
    const VectorXd residual = specimen.residual(model, ends.positions.col(l));
    const LinearModel there(specimen, model, std::move(of_path), residual, z.col(l));
    const MatrixXd of_data = LinearAt(there, model).gram().topLeftCorner(m, m) + MatrixXd::Identity(m, m);
    const double sign = l == 0 ? -1 : 1;
    change += sign * Eigen::LLT<MatrixXd>(of_data).matrixLLT().diagonal().array().log().sum();
    size +=
        sign * residual.tail(specimen.sizes_).cwiseProduct(units.tail(specimen.sizes_)).dot(one) / one.squaredNorm();
  }
  // No more than of a size that changes all data as it does the shape: where paths are bent the slope says nothing.
  const double exponent = std::clamp(-change / size, -static_cast<double>(m), static_cast<double>(m));
  return exponent * static_cast<double>(coordinates_) / static_cast<double>(m);
}

}  // namespace pulson::posterior
