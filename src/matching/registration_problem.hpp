#pragma once

#include "pulson/matching/registration.hpp"
#include "robust_fit.hpp"

namespace pulson::matching {

/// The weights of a loss, and what makes them.
struct RobustData {
  RobustFit fit;
  Eigen::VectorXd weights;  ///< in [0, 1]
};

/// What a registration is to solve, made of shapes and options; register_shapes() says what each part is.
struct RegistrationProblem {
  Landmarks original;  ///< the source without landmarks that miss a coordinate
  Landmarks source;    ///< aligned
  Landmarks target;    ///< of the same landmarks
  Alignment alignment;
  std::optional<DisplacementModel> fitted_kernel;
  MatchingMode mode = MatchingMode::kDeterministic;
  DataOptions data;
  MatchingProblem matching;
  std::shared_ptr<const DataTerm> coarse_data;  ///< of curves: of a greater width, where a search begins; else null
  std::optional<RobustData> robust;
  std::vector<std::string> notes;
};

/// @throws InputError where the shapes do not fit together or an option is wrong
RegistrationProblem make_problem(const Landmarks& source, const Landmarks& target, const RegistrationOptions& options);

/// Takes the weights of the loss that the residuals of a fit ask for. @param result q(T), d×N
/// @return whether they changed
bool reweight(RegistrationProblem& problem, const Points& result);

/// The coordinates that are observed, less the parameters of the alignment, which takes as many out of them. What is
/// fitted to them, but for momenta and noise, which have priors, must have fewer parameters, or is undetermined.
Eigen::Index free_coordinates(const RegistrationProblem& problem);

/// The increments of frozen realisations of the noise of a shape: the Brownian paths 0, 1, … of the seed on the finest
/// grid that twice, four, … times as many steps make of at least 1280, summed up over the steps of `grid`. So they are
/// the same paths on grids that halve each other's steps.
std::vector<Eigen::MatrixXd> realisations(const NoiseModel& noise, const Points& shape, const TimeGrid& grid,
                                          std::uint64_t seed, int count);

}  // namespace pulson::matching
