#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "draw/ensemble_picture.hpp"
#include "html/html_report.hpp"
#include "pulson/records/records.hpp"

namespace pulson {

/// `report.html` of an ensemble: how many paths are clean, the mean shape as it moves with some paths behind it, the
/// numbers, and mean and standard deviation of each landmark at the end. @param shape of make_ensemble_picture
/// @param picture PNG or SVG, or empty
html::HtmlReport ensemble_report(const records::EnsembleRun& run, const draw::EnsemblePicture& shape,
                                 const std::vector<std::string>& warnings, const std::vector<std::string>& notes,
                                 const std::filesystem::path& picture);

}  // namespace pulson
