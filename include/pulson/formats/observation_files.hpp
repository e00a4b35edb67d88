#pragma once

#include <filesystem>
#include <vector>

#include <Eigen/Core>

namespace pulson {

// Tables with a row per landmark, in the order of the shape. The first line may name the columns; blank lines and
// comments ('#') are skipped. Fields are separated by the first of ; , tab that the first line has, else by blanks.

/// The weights of `count` landmarks, one in each row: finite numbers, 0 or greater.
/// @throws InputError that names file and line
Eigen::VectorXd read_weights(const std::filesystem::path& path, int count);

/// The covariances of `count` landmarks in d dimensions, d×d each, length units squared. A row holds 1 number (the
/// variance of each coordinate), d (the variances of the axes), d(d+1)/2 (the upper triangle by rows) or d² (all by
/// rows). @throws InputError that names file and line, also where one is not symmetric and positive definite
std::vector<Eigen::MatrixXd> read_covariances(const std::filesystem::path& path, int count, int dimension);

}  // namespace pulson
