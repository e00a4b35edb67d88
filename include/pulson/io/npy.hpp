#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <vector>

namespace pulson {

/// Writes numbers as numpy's format, version 1.0: doubles in C order, to be read by `numpy.load`. The product of
/// `shape` is the count of the numbers. By write_file_atomically. @throws InputError if the file cannot be written
void write_npy(const std::filesystem::path& path, std::span<const double> numbers,
               const std::vector<std::size_t>& shape);

}  // namespace pulson
