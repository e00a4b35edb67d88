#pragma once

#include <string>

#include "html/html_report.hpp"
#include "judge.hpp"

namespace pulson {

/// `audit.json`
std::string audit_json(const AuditResults& results);
std::string findings_csv(const AuditResults& results);

/// The covariances of landmarks, as --covariances reads them.
std::string covariances_csv(const AuditResults& results);

/// "2 of 40 specimens of 12 landmarks look wrong", or "nothing looks wrong with 40 specimens of 12 landmarks"
std::string audit_verdict(const AuditResults& results);
/// "one shape in 50 has an error"
std::string prior_text(const AuditResults& results);

/// A line for each finding, and for each shape that is not judged.
void print_audit(const AuditResults& results);

/// @param is_drawn whether accused shapes are drawn
html::HtmlReport audit_report(const AuditResults& results, bool is_drawn);

}  // namespace pulson
