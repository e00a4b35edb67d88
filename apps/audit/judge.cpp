#include "judge.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "core/landmark_pairs.hpp"
#include "core/shape_frames.hpp"
#include "pulson/core/errors.hpp"
#include "shell/cohort_shapes.hpp"
#include "shell/messages.hpp"
#include "shell/picture_sizes.hpp"

namespace pulson {
namespace {

using Size = std::pair<int, int>;  // dimension, number of landmarks

Size size_of(const Landmarks& shape) { return {shape.dimension(), shape.count()}; }

// That of most shapes; of several the first.
Size usual_size(const std::vector<Landmarks>& shapes) {
  std::map<Size, int> counts;
  for (const Landmarks& shape : shapes) ++counts[size_of(shape)];
  Size usual = size_of(shapes.front());
  for (const Landmarks& shape : shapes)
    if (counts[size_of(shape)] > counts[usual]) usual = size_of(shape);
  return usual;
}

std::string size_text(const Size& size) {
  return fmt::format("{} in {}D", counted(size.second, "landmark"), size.first);
}

// @throws InputError where its landmarks do not correspond
JudgedShape judged_as(const Landmarks& first, const Landmarks& shape, std::size_t given, bool by_order,
                      std::vector<std::string>& notes) {
  if (shape.count() == 0) throw InputError("it has no landmarks");
  if (shape.dimension() != first.dimension())
    throw InputError(fmt::format("it has {}; most have {}", size_text(size_of(shape)), size_text(size_of(first))));
  const PairBy by = by_order ? PairBy::kOrder : PairBy::kNames;
  const Landmarks framed = in_frame_of(first, shape, notes);
  JudgedShape judged{given, in_order_of(first, framed, notes, by), {}};
  std::vector<std::string> again;
  const LandmarkPairs pairs = pair_landmarks(first, framed, again, by);
  judged.columns.assign(static_cast<std::size_t>(first.count()), -1);
  for (std::size_t i = 0; i < pairs.first.size(); ++i)
    judged.columns[static_cast<std::size_t>(pairs.first[i])] = pairs.other[i];
  return judged;
}

// Why a shape is not among those that are judged.
std::string reason_of(const Landmarks& shape, const Size& usual, const std::string& error) {
  if (size_of(shape) == usual || shape.count() == 0) return error;
  return fmt::format("it has {}, most have {}", size_text(size_of(shape)), size_text(usual));
}

void add_shapes(const std::vector<Landmarks>& shapes, const Landmarks& first, bool by_order, AuditResults& results) {
  CohortNotes notes;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    std::vector<std::string> of_shape;
    try {
      results.shapes.push_back(judged_as(first, shapes[i], i, by_order, of_shape));
    } catch (const InputError& error) {
      if (shapes.size() == 2) throw;
      results.not_judged.push_back(
          {shapes[i].name, shapes[i].source, reason_of(shapes[i], size_of(first), error.what())});
    }
    notes.add(std::move(of_shape));
  }
  results.notes = std::move(notes).lines();
}

void judge_cohort(AuditResults& results) {
  Progress progress;
  std::vector<Landmarks> shapes;
  for (const JudgedShape& judged : results.shapes) shapes.push_back(judged.shape);
  results.audit = audit::audit_cohort(shapes, [&](double fraction) { progress.show(fraction, "judging"); });
}

void judge_by_first(AuditResults& results) {
  results.is_of_cohort = false;
  const Landmarks& first = results.shapes.front().shape;
  Progress progress;
  for (std::size_t i = 1; i < results.shapes.size(); ++i) {
    progress.show(static_cast<double>(i - 1) / static_cast<double>(results.shapes.size() - 1), "judging");
    audit::Audit of_pair = audit::audit_pair(first, results.shapes[i].shape);
    for (audit::Finding& finding : of_pair.findings) finding.specimen = static_cast<int>(i);
    std::move(of_pair.findings.begin(), of_pair.findings.end(), std::back_inserter(results.audit.findings));
    results.audit.reference = std::move(of_pair.reference);
    results.audit.shapes_per_error = of_pair.shapes_per_error;
  }
  if (results.shapes.size() > 2)
    results.notes.push_back(
        fmt::format("{} shapes are too few for a law of their own, which {} have: each is judged by {}",
                    results.shapes.size(), audit::kFewestShapes, first.source));
}

void note_limits(const AuditResults& results, std::vector<std::string>& notes) {
  const Landmarks& first = results.shapes.front().shape;
  const int fewest = results.is_of_cohort ? audit::kFewestLandmarks : audit::kFewestLandmarksOfPair;
  if (first.dimension() == 1)
    notes.emplace_back(
        "on a line only sizes and codes of missing landmarks are judged: another order is no error there");
  else if (first.count() < fewest || first.count() > audit::kMostLandmarks)
    notes.push_back(fmt::format("of {} only sizes and codes of missing landmarks are judged; all else is of {} to {}",
                                counted(first.count(), "landmark"), fewest, audit::kMostLandmarks));
  else if (results.audit.reference.size() == 0)
    notes.emplace_back(
        "only sizes and codes of missing landmarks are judged: too few shapes have enough landmarks, or "
        "none has one of them");
  else if (results.is_of_cohort)
    for (const JudgedShape& judged : results.shapes) {
      const auto missing = std::ssize(incomplete_points(judged.shape.points));
      if (judged.shape.count() - missing < fewest)
        notes.push_back(fmt::format("{}: {} of {} landmarks are too few to be judged", judged.shape.source,
                                    judged.shape.count() - missing, judged.shape.count()));
    }
}

}  // namespace

std::size_t AuditResults::accused_count() const {
  std::set<int> specimens;
  for (const audit::Finding& finding : audit.findings) specimens.insert(finding.specimen);
  return specimens.size();
}

AuditResults judge_shapes(std::vector<Landmarks> shapes, bool by_order) {
  if (shapes.size() < 2)
    throw InputError(
        fmt::format("{}: an audit needs two shapes or more: the second is judged by the first, and each of {} "
                    "or more by the others",
                    shapes.empty() ? "no shape" : shapes.front().source, audit::kFewestShapes));
  const Size usual = usual_size(shapes);
  const bool is_cohort = shapes.size() >= audit::kFewestShapes;
  const auto first = is_cohort ? std::find_if(shapes.begin(), shapes.end(),
                                              [&](const Landmarks& shape) { return size_of(shape) == usual; })
                               : shapes.begin();
  std::vector<Landmarks*> all;
  for (Landmarks& shape : shapes) all.push_back(&shape);
  find_picture_sizes(all);
  AuditResults results;
  add_shapes(shapes, *first, by_order, results);
  if (results.shapes.size() < 2)
    throw InputError(fmt::format("{}: no landmarks of the other shapes correspond to its {}", first->source,
                                 counted(first->count(), "landmark")));
  if (is_cohort && results.shapes.size() >= audit::kFewestShapes)
    judge_cohort(results);
  else
    judge_by_first(results);
  note_limits(results, results.notes);
  const std::vector<std::string> of_names = notes_of_names(shapes);
  results.notes.insert(results.notes.end(), of_names.begin(), of_names.end());
  return results;
}

std::string landmark_name(const Landmarks& shape, int landmark) {
  return shape.labels.empty() ? fmt::to_string(shape.number(landmark))
                              : shape.labels[static_cast<std::size_t>(landmark)];
}

std::string odds_text(double log_odds) {
  constexpr double kWritten = 1e4;
  if (std::isinf(log_odds)) return "certain";
  return log_odds < std::log(kWritten) ? fmt::format("{:.0f}", std::exp(log_odds))
                                       : fmt::format("10^{:.0f}", log_odds / std::log(10.0));
}

}  // namespace pulson
