#pragma once

namespace pulson {

/// What the columns of tables mean that verbs write, and the keys of their JSON, with their units.
void print_columns();

}  // namespace pulson
