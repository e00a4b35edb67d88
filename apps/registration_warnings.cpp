#include "registration_warnings.hpp"

#include <cmath>

#include <fmt/core.h>

#include "messages.hpp"

namespace pulson {
namespace {

// A similarity that leaves less than this part of the distance is the first thing to try.
constexpr double kMostOfIt = 0.5;

// What a similarity would leave of the distance between the shapes as they were given.
double left_by_similarity(const Registration& registration) {
  const Points& source = registration.original.points;
  const Points moved = align(source, registration.target.points, AlignmentKind::kSimilarity).apply(source);
  const Eigen::ArrayXXd squares = (moved - registration.target.points).array().square();
  const double left = squares.isNaN().select(0, squares).sum() / static_cast<double>(source.cols());
  return std::sqrt(left) / registration.original_rms();
}

bool should_align(const Registration& registration) {
  const AlignmentKind kind = registration.alignment.kind;
  return registration.data.kind == DataKind::kLandmarks && registration.source.dimension() > 1 &&
         kind != AlignmentKind::kSimilarity && kind != AlignmentKind::kAffine &&
         left_by_similarity(registration) < kMostOfIt * registration.initial_rms() / registration.original_rms();
}

// The likeliest remedy.
std::string remedy(const Registration& registration) {
  if (should_align(registration))
    return fmt::format("try --align similarity, which leaves {:.0f} % of the distance",
                       100 * left_by_similarity(registration));
  const bool has_noise = registration.noise != "none";
  const std::string noise = "try --noise ch-sd:beta=100%, position noise that lets landmarks pass each other";
  if (registration.source.dimension() == 1 && !has_noise)
    if (const int pairs = order_inversions(registration.source.points, registration.target.points); pairs > 0)
      return fmt::format("{} another order in the target, which no flow can reach: {}",
                         counted(pairs, "pair", pairs == 1 ? "of landmarks has" : "of landmarks have"), noise);
  if (!registration.converged) return "try more --steps or --max-iterations" + (has_noise ? "" : "; or " + noise);
  return "try a smaller --sigma or --lambda" + (has_noise ? "" : "; for shapes that no flow can match " + noise);
}

}  // namespace

std::vector<std::string> registration_warnings(const Registration& registration) {
  std::vector<std::string> texts;
  if (!registration.matched())
    texts.push_back(fmt::format("not matched: rms {:.4g} is {:.0f} sigma and {:.0f} % of the distance before; {}",
                                registration.rms(), registration.rms() / registration.sigma,
                                100 * registration.rms() / registration.initial_rms(), remedy(registration)));
  if (!registration.converged)
    texts.push_back(fmt::format("not converged: {} after {} iterations{}", registration.stop_reason,
                                registration.iterations,
                                registration.matched() ? "; " + remedy(registration) : std::string()));
  return texts;
}

}  // namespace pulson
