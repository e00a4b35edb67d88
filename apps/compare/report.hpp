#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "html/html_report.hpp"
#include "pulson/compare/comparison.hpp"

namespace pulson {

/// `report.html` of a comparison: the verdict, the models, what each makes of each shape. Its numbers are those of
/// `comparison.json`, rounded. @param pictures PNG or SVG
html::HtmlReport comparison_report(const compare::Comparison& comparison, const std::vector<std::string>& notes,
                                   double seconds, const std::vector<std::filesystem::path>& pictures);

/// The same of a study of recovery. @param picture may be empty
html::HtmlReport recovery_report(const std::vector<compare::RecoveryRow>& rows,
                                 const std::vector<std::string>& candidates, const compare::RecoveryOptions& options,
                                 const std::vector<std::string>& notes, double seconds,
                                 const std::filesystem::path& picture);

}  // namespace pulson
