#include <bit>
#include <cmath>
#include <cstdint>

#include "fields/grid_formats.hpp"
#include "fuzz_targets.hpp"
#include "fuzzing.hpp"
#include "pulson/fields/grid_fields.hpp"

namespace pulson::fuzz {
namespace {

void check_field(const fields::GridField& field) {
  const std::size_t d = field.sizes.size();
  require(d == 2 || d == 3, "a field is in 2D or 3D");
  require(field.spacing.size() == d && field.origin.size() == d, "a field has a spacing and a place for each axis");
  std::size_t count = static_cast<std::size_t>(field.components);
  for (const int size : field.sizes) count *= static_cast<std::size_t>(size);
  require(field.values.size() == count, "a field has as many values as its sizes say");
}

bool has_same_bits(const fields::GridField& a, const fields::GridField& b) {
  if (a.sizes != b.sizes || a.components != b.components || a.values.size() != b.values.size()) return false;
  for (std::size_t i = 0; i < a.values.size(); ++i)
    if (std::bit_cast<std::uint32_t>(a.values[i]) != std::bit_cast<std::uint32_t>(b.values[i])) return false;
  return true;
}

}  // namespace

bool grid_fields(std::string_view input) {
  const MemoryFile file(input);
  const auto field = attempt([&] { return fields::read_grid_field(file.path()); });
  if (!field) return true;
  check_field(*field);
  for (const auto write : {fields::meta_image_file, fields::nrrd_file})
    for (const bool is_compressed : {false, true}) {
      const MemoryFile copy(write(fields::grid_of(*field), is_compressed));
      const fields::GridField back =
          demand("a field that is written is not read", [&] { return fields::read_grid_field(copy.path()); });
      require(has_same_bits(back, *field), "a field changes when it is written and read");
    }
  return true;
}

}  // namespace pulson::fuzz
