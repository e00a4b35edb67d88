#include <array>
#include <cmath>
#include <string>

#include <fmt/format.h>

#include "audit.hpp"

namespace pulson::audit {
namespace {

std::string without(const Finding& finding) {
  if (std::isinf(finding.log_odds))
    return fmt::format("(rms distance {:.3g}, {:.3g} without)", finding.before, finding.after);
  return fmt::format("(odds 10^{:.0f}; rms distance {:.3g}, {:.3g} without)", finding.log_odds / std::log(10.0),
                     finding.before, finding.after);
}

/// "landmark 3", "landmarks 3 and 7", "landmarks 1, 3, 7 and 2 more".
std::string named(const Finding& finding, const Landmarks& shape) {
  constexpr std::size_t kMost = 5;
  const std::size_t count = finding.landmarks.size(), shown = count > kMost ? kMost - 1 : count;
  std::string text = count == 1 ? "landmark " : "landmarks ";
  for (std::size_t i = 0; i < shown; ++i) {
    if (i > 0) text += i + 1 == count ? " and " : ", ";
    text += shape.describe(finding.landmarks[i]);
  }
  return count > shown ? fmt::format("{} and {} more", text, count - shown) : text;
}

// The first landmark of the run has no position, and the position of the last one belongs nowhere.
std::string reason_of_shift(const Finding& finding, const Landmarks& shape) {
  const int without_place = finding.landmarks.front(), junk = finding.landmarks.back();
  const bool is_at_end = without_place == 0 || without_place == shape.count() - 1;
  if (is_at_end && junk > 0 && junk < shape.count() - 1)
    return fmt::format("the point of {} were one too many", shape.describe(junk));
  return fmt::format("{} had been left out", shape.describe(without_place));
}

}  // namespace

std::string_view problem_name(Problem problem) {
  constexpr std::array<std::string_view, 11> kNames = {"exchanged", "moved",     "reversed",    "shifted",
                                                       "mirrored",  "zero",      "undigitised", "unit",
                                                       "axes",      "unordered", "foreign"};
  return kNames.at(static_cast<std::size_t>(problem));
}

std::string describe(const Finding& finding, const Landmarks& shape) {
  const auto landmark = [&](std::size_t i) { return shape.describe(finding.landmarks.at(i)); };
  switch (finding.problem) {
    case Problem::kExchanged:
      return fmt::format("{} look exchanged {}", named(finding, shape), without(finding));
    case Problem::kReversed:
      if (finding.landmarks.size() > 1)
        return fmt::format("the run of landmarks {} to {} looks to be in reverse order {}", landmark(0),
                           landmark(finding.landmarks.size() - 1), without(finding));
      return fmt::format("its landmarks look to be in reverse order, from {} backwards {}", landmark(0),
                         without(finding));
    case Problem::kShifted:
      if (finding.landmarks.size() > 1)
        return fmt::format("landmarks {} to {} look shifted by one, as if {} {}", landmark(0),
                           landmark(finding.landmarks.size() - 1), reason_of_shift(finding, shape), without(finding));
      return fmt::format("its landmarks look shifted, the first one to {} {}", landmark(0), without(finding));
    case Problem::kMirrored:
      return fmt::format("it looks mirrored {}", without(finding));
    case Problem::kUnit:
      return fmt::format("it is {:.3g} times as large as the others: is it in another unit of length?", finding.factor);
    case Problem::kUnordered:
      return fmt::format(
          "its landmarks have nothing in common with those of the same number (rms distance {:.3g} after alignment): "
          "is there a correspondence?",
          finding.before);
    case Problem::kMoved:
      return fmt::format("{} looks misplaced{}{} {}", named(finding, shape), finding.slip.empty() ? "" : ": ",
                         finding.slip, without(finding));
    case Problem::kZero:
      return fmt::format("{} {} where one that is missing is written {}", named(finding, shape),
                         finding.landmarks.size() == 1 ? "is" : "are", without(finding));
    case Problem::kUndigitised:
      return "all of its landmarks are at one place: it was not digitised";
    case Problem::kAxes:
      return fmt::format("its axes look exchanged {}", without(finding));
    case Problem::kForeign:
      return fmt::format("it has nothing in common with the others (rms distance {:.3g}): does it belong to them?",
                         finding.before);
  }
  return {};
}

}  // namespace pulson::audit
