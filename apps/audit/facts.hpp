#pragma once

#include <vector>

#include "judge.hpp"
#include "shell/facts.hpp"

namespace pulson {

/// A finding of an audit.
struct FindingRow {
  const AuditResults* results;
  const audit::Finding* finding;

  const Landmarks& shape() const { return results->shape_of(*finding); }
};

const Facts<FindingRow>& finding_facts();
std::vector<FindingRow> finding_rows(const AuditResults& results);

/// What repeats say of one landmark.
struct RepeatRow {
  const AuditResults* results;
  int landmark;
};

const Facts<RepeatRow>& repeat_facts();
std::vector<RepeatRow> repeat_rows(const AuditResults& results);

/// What is known beside the kind: what was probably typed, or how many times as large it is; else empty.
std::string detail_of(const audit::Finding& finding);

/// The names of landmarks, of many the first and how many there are.
std::string some_names(const Landmarks& shape, const std::vector<int>& landmarks);

}  // namespace pulson
