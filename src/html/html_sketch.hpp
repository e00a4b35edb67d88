#pragma once

#include <string>

#include "html/html_report.hpp"

namespace pulson::html {

/// The drawing as SVG within the page, 4:3. @throws InputError where sizes disagree or a number but of the target is
/// not finite
std::string sketch(const ReportSketch& sketch);

}  // namespace pulson::html
