#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "audit/audit.hpp"
#include "audit/repeats.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson {

/// A shape as it is judged.
struct JudgedShape {
  std::size_t given;         ///< its place among the shapes that were given
  Landmarks shape;           ///< in the order, axes and unit of length of the others
  std::vector<int> columns;  ///< the place of each of its landmarks in the shape as given; -1: that lacks it
};

struct ShapeNotJudged {
  std::string specimen, source;
  std::string reason;
};

/// Everything that `pulson audit` finds.
struct AuditResults {
  std::vector<JudgedShape> shapes;
  audit::Audit audit;        ///< its specimens are places in `shapes`
  bool is_of_cohort = true;  ///< else each but the first was judged by the first alone
  std::vector<ShapeNotJudged> not_judged;
  std::optional<audit::Repeatability> repeats;
  std::vector<std::string> notes;

  /// How many were judged: the first is not where it is what others are judged by.
  std::size_t judged_count() const { return shapes.size() - (is_of_cohort ? 0 : 1); }
  const Landmarks& shape_of(const audit::Finding& finding) const {
    return shapes[static_cast<std::size_t>(finding.specimen)].shape;
  }
  /// How many shapes have a finding.
  std::size_t accused_count() const;
};

/// Judges each shape by a law of the others where there are enough for one, else each but the first by the first.
/// Shapes that do not correspond to most of the others are not judged.
/// @throws InputError where there are fewer than two, or of two the landmarks do not correspond
AuditResults judge_shapes(std::vector<Landmarks> shapes, bool by_order);

/// "10", "'tip'": the landmark in tables and records: its label, else its number from 1.
std::string landmark_name(const Landmarks& shape, int landmark);

/// "10^9", or "120" where they are less than 10^4; "certain" where no model is needed.
std::string odds_text(double log_odds);

}  // namespace pulson
