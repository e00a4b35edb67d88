#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "html/html_report.hpp"
#include "pulson/draw/pictures.hpp"
#include "pulson/records/records.hpp"

namespace pulson {

/// `report.html` of a registration: what was found, the landmarks as they move, the numbers, and each landmark's
/// residual. @param picture PNG or SVG, or empty @param notes of the run
/// @param below the image below the landmarks; without a file where there is none
HtmlReport registration_report(const Registration& registration, const Trajectory& path, const RegistrationFacts& facts,
                               const std::vector<std::string>& notes, const std::filesystem::path& picture,
                               const PlacedImage& below);

/// Landmarks whose distance stands out: above the median m of all by more than 5 · 1.4826 · median |distance − m| (for
/// normal numbers, five standard deviations) and above 2σ, so that a close match has no outliers. Distances that are
/// NaN play no part.
std::vector<int> outlying_landmarks(const Eigen::VectorXd& distances, double sigma);

}  // namespace pulson
