#pragma once

#include <cstddef>
#include <vector>

#include <Eigen/Core>

namespace pulson {

/// A matrix of these vectors, which have the same size. @param vectors at least one
inline Eigen::MatrixXd columns_of(const std::vector<Eigen::VectorXd>& vectors) {
  Eigen::MatrixXd columns(vectors.front().size(), std::ssize(vectors));
  for (std::size_t j = 0; j < vectors.size(); ++j) columns.col(static_cast<Eigen::Index>(j)) = vectors[j];
  return columns;
}

}  // namespace pulson
