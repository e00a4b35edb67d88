#pragma once

#include "formats/json/json_reader.hpp"

namespace pulson {

/// What the columns of tables mean that verbs write, and the keys of their JSON, with their units.
void print_columns();

/// The same: `columns`, a list of the files and their columns.
formats::Json columns_json();

}  // namespace pulson
