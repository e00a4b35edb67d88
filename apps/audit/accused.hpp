#pragma once

#include <vector>

#include "audit/audit.hpp"
#include "html/html_report.hpp"

namespace pulson {

/// A section of a page for each shape that an audit accuses: what is wrong, and a picture of the shape and of its
/// correction. @param shapes that were judged, in the plane or in space; their reference must be complete
void add_accused(html::HtmlReport& report, const std::vector<Landmarks>& shapes, const audit::Audit& found);

}  // namespace pulson
