#pragma once

#include <optional>
#include <string>
#include <vector>

#include "formats/surfaces/surface_files.hpp"
#include "html/html_report.hpp"
#include "pulson/draw/pictures.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// The surface on which the landmarks of a source in space lie: of `file`, or, where that is empty, of the file with
/// the name of the source's and the extension ply, stl or obj, if it is beside it; else none. Its axes, where it does
/// not say them, and its unit are those of the source. @throws InputError where `file` is given and cannot be used
std::optional<formats::Surface> surface_of(const Landmarks& source, const std::string& file,
                                           std::vector<std::string>& notes);

/// Puts the surface below the landmarks of the picture, with the aligned source before, and as the flow carries it
/// after. A line is added to `notes` where it lies elsewhere than the landmarks, and is not drawn.
void add_surface(const std::optional<formats::Surface>& surface, const matching::Registration& registration,
                 const Trajectory& path, draw::RegistrationPicture& picture, std::vector<std::string>& notes);

/// The same for the motion of the page, coarser, from the picture.
void add_surface(const draw::RegistrationPicture& picture, const matching::Registration& registration,
                 const Trajectory& path, html::ReportMotion& motion);

}  // namespace pulson
