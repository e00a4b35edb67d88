#pragma once

#include <string>
#include <vector>

#include "pulson/core/landmarks.hpp"

namespace pulson {

/// `other` with its landmarks in the order of those of `first` that have the same labels, where both shapes have the
/// same labels, each once; else as it is. Tells in `notes`, one line each, that the order was changed, or that labels
/// which both shapes have stand at other places and do not tell which landmarks belong together.
Landmarks paired_by_labels(const Landmarks& first, const Landmarks& other, std::vector<std::string>& notes);

}  // namespace pulson
