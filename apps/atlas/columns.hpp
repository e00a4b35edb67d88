#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// What `--covariate` and `--groups` say of each specimen: the fields of column COLUMN of the table FILE. Rows belong
/// to specimens by their names, where some column has all of them, else by their order. @param option is named in
/// messages
/// @throws InputError where there is no such file or column, or the rows do not fit
std::vector<std::string> column_of_table(const std::string& address, const std::vector<Landmarks>& shapes,
                                         const std::string& option);

/// The same as numbers, NaN for a missing one. @throws InputError
Eigen::VectorXd numbers_of_table(const std::string& address, const std::vector<Landmarks>& shapes,
                                 const std::string& option);

/// A column of a table or, where the address has no `:`, the comment of that name that the file has for each shape.
/// @throws InputError
std::vector<std::string> groups_of(const std::string& address, const std::vector<Landmarks>& shapes);

}  // namespace pulson
