#pragma once

#include <string>
#include <vector>

#include <Eigen/Core>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// A table whose rows say more of the specimens, and how its rows belong to them.
struct SpecimenTable {
  std::string address;  ///< FILE:COLUMN, or FILE where the column is named
  std::string option;   ///< that names it, for messages
  bool by_order = false;
  std::string column{};
};

/// The fields of column COLUMN of the table FILE, one for each specimen. Rows belong to specimens by their names, or
/// the names of their images, in the column that has most of them, as match_names() pairs names: `specimen`, `id` and
/// the like, else any. Rows belong by order only where neither shapes nor rows have names, or `by_order` says so.
/// `notes` get a line on names that are not equal, and on rows that are not used.
/// @throws InputError where there is no such file or column, a specimen has no row, with all such, or the names do not
/// say which it is
std::vector<std::string> column_of_table(const SpecimenTable& table, const std::vector<Landmarks>& shapes,
                                         std::vector<std::string>& notes);

/// The same as numbers, NaN for a missing one. @throws InputError
Eigen::VectorXd numbers_of_table(const SpecimenTable& table, const std::vector<Landmarks>& shapes,
                                 std::vector<std::string>& notes);

/// The columns of the table FILE. @throws InputError where there is none
std::vector<std::string> columns_in_table(const std::string& file);

/// Whether a name is among those, as column_of_table() compares names.
bool has_name(const std::vector<std::string>& names, const std::string& name);

/// The names of the comments that the shapes' files have.
std::vector<std::string> properties_of(const std::vector<Landmarks>& shapes);

/// The comment of that name of each shape, empty where it has none.
std::vector<std::string> property_of(const std::vector<Landmarks>& shapes, const std::string& name);

/// A column of a table or, where the address has no `:`, the comment of that name that the file has for each shape.
/// @throws InputError
std::vector<std::string> groups_of(const SpecimenTable& table, const std::vector<Landmarks>& shapes,
                                   std::vector<std::string>& notes);

}  // namespace pulson
