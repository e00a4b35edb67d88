#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "html/html_report.hpp"
#include "picture.hpp"
#include "pulson/draw/pictures.hpp"
#include "pulson/records/records.hpp"

namespace pulson {

/// What lies below the landmarks as they move.
struct BelowLandmarks {
  const std::optional<PageImage>& image;
  const draw::RegistrationPicture& still;  ///< with the surface
};

/// `report.html` of a registration: what was found, the landmarks as they move, the numbers, and each landmark's
/// residual. @param picture PNG or SVG, or empty @param notes of the run
html::HtmlReport registration_report(const matching::Registration& registration, const Trajectory& path,
                                     const records::RegistrationFacts& facts, const std::vector<std::string>& notes,
                                     const std::filesystem::path& picture, const BelowLandmarks& below);

}  // namespace pulson
