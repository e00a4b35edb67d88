// How often pulson audit finds an error of each kind, planted into specimens of a cohort: a table in Markdown, see
// docs/audit_checked.md.
//
//   audit_kinds [--plants 100] [--kinds exchanged,reversed,…] [--seed 1] NAME=FILE …
//
// For each plant: a specimen in which nothing was found is drawn, one error is planted into it, and the whole cohort is
// audited. --pairs: two specimens are drawn, an exchange is planted into the second, and it is judged by the first.

#include <algorithm>
#include <cmath>
#include <exception>
#include <functional>
#include <map>
#include <memory>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "audit/audit.hpp"
#include "audit/cohort_law.hpp"
#include "pulson/core/alignment.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace {

using namespace pulson;
using audit::Finding;
using audit::Problem;

// A specimen with errors, and what should be found: the landmarks of each error, or none where it is of all of them.
struct Planted {
  Points points;
  Problem problem;
  std::vector<std::vector<int>> landmarks;
};

/// Cohort, specimen and random numbers: what an error is planted into.
class Ground {
 public:
  Ground(const std::vector<Landmarks>& shapes, const std::vector<bool>& accused, std::uint64_t seed)
      : shapes_(shapes), accused_(accused), engine_(seed) {}

  void draw_specimen() {
    do specimen_ = below(static_cast<int>(shapes_.size()));
    while (accused_[static_cast<std::size_t>(specimen_)]);
  }

  int specimen() const { return specimen_; }
  const Points& points() const { return shapes_[static_cast<std::size_t>(specimen_)].points; }
  int count() const { return static_cast<int>(points().cols()); }
  int dimension() const { return static_cast<int>(points().rows()); }
  std::mt19937_64& engine() { return engine_; }

  int below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(engine_); }
  double normal() { return std::normal_distribution<double>()(engine_); }

  // Different landmarks that the specimen has, in their order.
  std::vector<int> landmarks(int how_many) {
    std::vector<int> all;
    for (int a = 0; a < count(); ++a)
      if (points().col(a).allFinite()) all.push_back(a);
    std::shuffle(all.begin(), all.end(), engine_);
    all.resize(static_cast<std::size_t>(how_many));
    std::sort(all.begin(), all.end());
    return all;
  }

  // Of a landmark by the other specimens and the others of its own, units of the specimen.
  double predicted_deviation(int landmark) {
    if (!law_) fit_law();
    audit::LandmarkLaw law = law_->law_without(static_cast<std::size_t>(specimen_));
    const Points aligned = align(points(), law.reference(), AlignmentKind::kSimilarity).apply(points());
    Eigen::VectorXd displacement = (aligned - law.reference()).reshaped();
    for (int a = 0; a < count(); ++a)
      if (!points().col(a).allFinite()) {
        law.drop(a);
        displacement.segment(a * dimension(), dimension()).setZero();
      }
    return law.predict(displacement)[static_cast<std::size_t>(landmark)].spread * centroid_size(points()) /
           centroid_size(law.reference());
  }

 private:
  void fit_law() {
    std::vector<Points> all;
    for (const Landmarks& shape : shapes_) all.push_back(shape.points);
    directions_ = std::make_unique<audit::ShapeDirections>(procrustes_mean(shapes_, AlignmentKind::kSimilarity).points);
    law_ = std::make_unique<audit::CohortLaw>(all, *directions_, accused_);
  }

  const std::vector<Landmarks>& shapes_;
  const std::vector<bool>& accused_;
  std::mt19937_64 engine_;
  int specimen_ = 0;
  std::unique_ptr<audit::ShapeDirections> directions_;
  std::unique_ptr<audit::CohortLaw> law_;
};

Planted exchanged(Ground& ground) {
  Points points = ground.points();
  const std::vector<int> pair = ground.landmarks(2);
  points.col(pair[0]).swap(points.col(pair[1]));
  return {points, Problem::kExchanged, {pair}};
}

Planted exchanged_twice(Ground& ground) {
  Points points = ground.points();
  const std::vector<int> four = ground.landmarks(4);
  points.col(four[0]).swap(points.col(four[2]));
  points.col(four[1]).swap(points.col(four[3]));
  return {points, Problem::kExchanged, {{four[0], four[2]}, {four[1], four[3]}}};
}

// A run of at least four landmarks and at most half of all and one.
Planted run_reversed(Ground& ground) {
  const int n = ground.count(), length = 4 + ground.below(n / 2 - 2), first = ground.below(n - length + 1);
  Points points = ground.points();
  points.middleCols(first, length) = ground.points().middleCols(first, length).rowwise().reverse().eval();
  std::vector<int> run(static_cast<std::size_t>(length));
  std::iota(run.begin(), run.end(), first);
  return {points, Problem::kReversed, {run}};
}

Planted reversed(Ground& ground) { return {Points(ground.points().rowwise().reverse()), Problem::kReversed, {}}; }

Planted shifted(Ground& ground) {
  Points points = ground.points();
  const Eigen::Index n = points.cols();
  points << ground.points().rightCols(n - 1), ground.points().leftCols(1);
  return {points, Problem::kShifted, {}};
}

// One landmark is left out, and a point near the end makes up for it.
Planted skipped(Ground& ground) {
  const int n = ground.count(), from = ground.below(n - 3);
  Points points = ground.points();
  points.middleCols(from, n - 1 - from) = ground.points().rightCols(n - 1 - from);
  points.col(n - 1) += 0.1 * (ground.points().col(0) - points.col(n - 1));
  std::vector<int> run(static_cast<std::size_t>(n - from));
  std::iota(run.begin(), run.end(), from);
  return {points, Problem::kShifted, {run}};
}

Planted mirrored(Ground& ground) {
  Points points = ground.points();
  points.row(0) *= -1;
  return {points, Problem::kMirrored, {}};
}

Planted in_other_axes(Ground& ground) {
  Points points = ground.points();
  points.row(0).swap(points.row(1));
  return {points, Problem::kAxes, {}};
}

Planted at_origin(Ground& ground) {
  Points points = ground.points();
  const std::vector<int> one = ground.landmarks(1);
  points.col(one[0]).setZero();
  return {points, Problem::kZero, {one}};
}

Planted ten_times(Ground& ground) {
  Points points = ground.points();
  const std::vector<int> one = ground.landmarks(1);
  points(ground.below(ground.dimension()), one[0]) *= 10;
  return {points, Problem::kMoved, {one}};
}

Planted x_for_y(Ground& ground) {
  Points points = ground.points();
  const std::vector<int> one = ground.landmarks(1);
  std::swap(points(0, one[0]), points(1, one[0]));
  return {points, Problem::kMoved, {one}};
}

// By so many predicted standard deviations.
Planted moved(Ground& ground, double deviations) {
  Points points = ground.points();
  const std::vector<int> one = ground.landmarks(1);
  Eigen::VectorXd direction =
      Eigen::VectorXd::NullaryExpr(ground.dimension(), [&](Eigen::Index) { return ground.normal(); });
  points.col(one[0]) += direction.normalized() * deviations * ground.predicted_deviation(one[0]);
  return {points, Problem::kMoved, {one}};
}

Planted unordered(Ground& ground) {
  std::vector<int> order(static_cast<std::size_t>(ground.count()));
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), ground.engine());
  return {Points(ground.points()(Eigen::all, order)), Problem::kUnordered, {}};
}

Planted foreign(Ground& ground) {
  const double deviation = centroid_size(ground.points()) / std::sqrt(static_cast<double>(ground.points().size()));
  Points points =
      Points::NullaryExpr(ground.dimension(), ground.count(), [&](auto, auto) { return deviation * ground.normal(); });
  points.colwise() += ground.points().rowwise().mean();
  return {points, Problem::kForeign, {}};
}

Planted in_inches(Ground& ground) { return {Points(25.4 * ground.points()), Problem::kUnit, {}}; }

Planted undigitised(Ground& ground) {
  return {Points::Zero(ground.dimension(), ground.count()), Problem::kUndigitised, {}};
}

struct Kind {
  std::string name;
  std::function<Planted(Ground&)> plant;
};

const std::vector<Kind>& all_kinds() {
  static const std::vector<Kind> kinds = {{"exchanged", exchanged},
                                          {"exchanged-twice", exchanged_twice},
                                          {"reversed", reversed},
                                          {"run-reversed", run_reversed},
                                          {"shifted", shifted},
                                          {"skipped", skipped},
                                          {"mirrored", mirrored},
                                          {"axes", in_other_axes},
                                          {"zero", at_origin},
                                          {"ten-times", ten_times},
                                          {"x-for-y", x_for_y},
                                          {"moved-6", [](Ground& ground) { return moved(ground, 6); }},
                                          {"moved-8", [](Ground& ground) { return moved(ground, 8); }},
                                          {"moved-12", [](Ground& ground) { return moved(ground, 12); }},
                                          {"unordered", unordered},
                                          {"foreign", foreign},
                                          {"unit", in_inches},
                                          {"undigitised", undigitised}};
  return kinds;
}

bool has_kind(const std::vector<Finding>& found, Problem problem) {
  return std::any_of(found.begin(), found.end(), [&](const Finding& f) { return f.problem == problem; });
}

bool has_each(const std::vector<Finding>& found, const Planted& planted) {
  return std::all_of(planted.landmarks.begin(), planted.landmarks.end(), [&](const std::vector<int>& error) {
    return std::any_of(found.begin(), found.end(), [&](const Finding& finding) {
      std::vector<int> landmarks = finding.landmarks;
      std::sort(landmarks.begin(), landmarks.end());
      return finding.problem == planted.problem && landmarks == error;
    });
  });
}

// "moved 3, shifted 1"
std::string counts_text(const std::map<std::string, int>& counts) {
  std::vector<std::string> parts;
  for (const auto& [name, count] : counts) parts.push_back(fmt::format("{} {}", name, count));
  return fmt::format("{}", fmt::join(parts, ", "));
}

// What was found of plants of one kind.
struct Tally {
  int plants = 0, kind = 0, exact = 0, others = 0;
  std::map<std::string, int> instead;  // what is said first where the kind is another one

  void add(const std::vector<Finding>& own, const Planted& planted, bool is_other_accused) {
    ++plants;
    const bool is_kind = has_kind(own, planted.problem);
    kind += is_kind ? 1 : 0;
    exact += is_kind && has_each(own, planted) ? 1 : 0;
    others += is_other_accused ? 1 : 0;
    if (!is_kind) ++instead[own.empty() ? "nothing" : std::string(problem_name(own.front().problem))];
  }

  void print(const std::string& name, const std::string& cohort) const {
    fmt::print("| {} | {} | {} | {} | {} | {} | {} |\n", cohort, name, plants, kind, exact, others,
               counts_text(instead));
    std::fflush(stdout);
  }
};

struct Cohort {
  std::string name;
  std::vector<Landmarks> shapes;
  std::vector<bool> accused;  // as published
};

// Shapes of the number of landmarks that most have.
Cohort read_cohort(const std::string& argument) {
  const std::size_t equals = argument.find('=');
  const std::string file = equals == std::string::npos ? argument : argument.substr(equals + 1);
  Cohort cohort{argument.substr(0, equals), formats::read_addressed_shapes(file).shapes, {}};
  std::map<int, int> counts;
  for (const Landmarks& shape : cohort.shapes) ++counts[shape.count()];
  const auto most =
      std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  std::erase_if(cohort.shapes, [&](const Landmarks& shape) { return shape.count() != most->first; });
  if (cohort.shapes.size() < audit::kFewestShapes || most->first < audit::kFewestLandmarksOfPair ||
      cohort.shapes.front().dimension() < 2)
    throw InputError(argument + ": a cohort needs 5 shapes of 8 landmarks in the plane or in space");
  cohort.accused.assign(cohort.shapes.size(), false);
  for (const Finding& finding : audit::audit_cohort(cohort.shapes).findings)
    cohort.accused[static_cast<std::size_t>(finding.specimen)] = true;
  const auto count = std::count(cohort.accused.begin(), cohort.accused.end(), true);
  cohort.name = fmt::format("{}, {} × {}", cohort.name, cohort.shapes.size(), most->first);
  if (count > 0) cohort.name += fmt::format(" ({} accused as published)", count);
  if (std::ssize(cohort.shapes) - count < 2)
    throw InputError(argument + ": fewer than two specimens are not accused as published");
  return cohort;
}

void study_kind(const Cohort& cohort, const Kind& kind, int plants, std::uint64_t seed) {
  Ground ground(cohort.shapes, cohort.accused, seed);
  Tally tally;
  for (int i = 0; i < plants; ++i) {
    ground.draw_specimen();
    const Planted planted = kind.plant(ground);
    std::vector<Landmarks> shapes = cohort.shapes;
    shapes[static_cast<std::size_t>(ground.specimen())].points = planted.points;
    std::vector<Finding> own;
    bool is_other_accused = false;
    for (const Finding& finding : audit::audit_cohort(shapes).findings)
      if (finding.specimen == ground.specimen())
        own.push_back(finding);
      else if (!cohort.accused[static_cast<std::size_t>(finding.specimen)])
        is_other_accused = true;
    tally.add(own, planted, is_other_accused);
  }
  tally.print(kind.name, cohort.name);
}

// An exchange, and, in the column of others, pairs that are accused as they are.
void study_pairs(const Cohort& cohort, int plants, std::uint64_t seed) {
  Ground ground(cohort.shapes, cohort.accused, seed);
  Tally tally;
  for (int i = 0; i < plants; ++i) {
    ground.draw_specimen();
    const Landmarks& first = cohort.shapes[static_cast<std::size_t>(ground.specimen())];
    const int drawn = ground.specimen();
    while (ground.specimen() == drawn) ground.draw_specimen();
    Landmarks second = cohort.shapes[static_cast<std::size_t>(ground.specimen())];
    const bool is_accused = !audit::audit_pair(first, second).findings.empty();
    const Planted planted = exchanged(ground);
    second.points = planted.points;
    tally.add(audit::audit_pair(first, second).findings, planted, is_accused);
  }
  tally.print("exchanged, pairs", cohort.name);
}

int run(int argc, char** argv) {
  CLI::App program("How often an audit finds planted errors");
  std::vector<std::string> cohorts, kinds;
  int plants = 100;
  bool in_pairs = false;
  std::uint64_t seed = 1;
  std::vector<std::string> names;
  for (const Kind& kind : all_kinds()) names.push_back(kind.name);
  program.add_option("COHORT", cohorts, "NAME=FILE")->required();
  program.add_option("--kinds", kinds, "all by default")->delimiter(',')->check(CLI::IsMember(names));
  program.add_option("--plants", plants, "of each kind")->check(CLI::PositiveNumber);
  program.add_flag("--pairs", in_pairs, "exchanges in pairs of specimens");
  program.add_option("--seed", seed);
  CLI11_PARSE(program, argc, argv);
  fmt::print(
      "| cohort | planted | plants | kind found | exactly | others accused | found instead "
      "|\n|---|---|---|---|---|---|---|\n");
  for (const std::string& argument : cohorts) {
    const Cohort cohort = read_cohort(argument);
    if (in_pairs) {
      study_pairs(cohort, plants, seed);
      continue;
    }
    for (const Kind& kind : all_kinds())
      if (kinds.empty() || std::find(kinds.begin(), kinds.end(), kind.name) != kinds.end())
        study_kind(cohort, kind, plants, seed);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "audit_kinds: {}\n", error.what());
    return 1;
  }
}
