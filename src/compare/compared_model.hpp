#pragma once

#include <string>
#include <utility>

#include "pulson/compare/comparison.hpp"

namespace pulson::compare {

/// Eigenvectors of K(q0) in the order of falling eigenvalues.
struct KernelBasis {
  Eigen::VectorXd eigenvalues;
  Eigen::MatrixXd vectors;
};

KernelBasis kernel_basis(const KernelChoice& kernel, const Points& source);

/// Mean square over samples and axes of the displacements along each eigenvector, and its standard error.
/// @param ends dN×M, a column for each sample
std::pair<Eigen::VectorXd, Eigen::VectorXd> spectrum_of(const KernelBasis& basis, const Points& source,
                                                        const Eigen::MatrixXd& ends);

/// The fit of one model to the shapes of a comparison, with what is known of it without the others: all of a
/// ComparedModel but its rank. Thread-safe.
/// @param none the fit without noise, where the search begins, too; or null
/// @param failure gets a note where there is no prediction
ComparedModel compared_model(const Comparison& comparison, const CohortShapes& shapes, const KernelBasis& basis,
                             const NoiseChoice& noise, const CompareOptions& options, const CohortFit* none,
                             std::string& failure);

}  // namespace pulson::compare
