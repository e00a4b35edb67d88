#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string>
#include <vector>

namespace pulson {

/// Numbers in numpy's format, version 1.0: doubles in C order, to be read by `numpy.load`. The product of `shape` is
/// the count of the numbers.
std::string npy_bytes(std::span<const double> numbers, const std::vector<std::size_t>& shape);

/// Writes npy_bytes by write_file_atomically. @throws InputError if the file cannot be written
void write_npy(const std::filesystem::path& path, std::span<const double> numbers,
               const std::vector<std::size_t>& shape);

}  // namespace pulson
