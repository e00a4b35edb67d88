#include "registration_warnings.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <fmt/core.h>

#include "core/determined.hpp"
#include "pulson/matching/landmark_predictions.hpp"
#include "pulson/noise/noise_table.hpp"
#include "shell/messages.hpp"
#include "verdict_texts.hpp"

namespace pulson {
namespace {

// A similarity that leaves less than this part of the distance is the first thing to try.
constexpr double kMostOfIt = 0.5;

// What an accurate integrator may change unmentioned: diameters or σ, and parts of the cost.
constexpr double kSmallDistance = 1e-4;
constexpr double kSmallPart = 0.1;
constexpr double kSmallChange = 0.01;
// A cost, in nats, whose changes matter to nobody.
constexpr double kNoCost = 1e-6;
// Of the cost: a change that more steps hardly reduce where errors grow more than a hundredfold.
constexpr double kManySteps = 1;
constexpr double kLargeAmplification = 100;

// A whole number, unless it has many digits.
std::string rounded(double value) { return value < 1e6 ? fmt::format("{:.0f}", value) : fmt::format("{:.3g}", value); }

// What a similarity would leave of the distance between the shapes as they were given.
double left_by_similarity(const matching::Registration& registration) {
  const Points& source = registration.original.points;
  const Points moved = align(source, registration.target.points, AlignmentKind::kSimilarity).apply(source);
  const Eigen::ArrayXXd squares = (moved - registration.target.points).array().square();
  const double left = squares.isNaN().select(0, squares).sum() / static_cast<double>(source.cols());
  return std::sqrt(left) / registration.original_rms();
}

bool should_align(const matching::Registration& registration) {
  const AlignmentKind kind = registration.alignment.kind;
  return registration.data.kind == matching::DataKind::kLandmarks && kind != AlignmentKind::kSimilarity &&
         kind != AlignmentKind::kAffine &&
         is_determined(registration.original.points, registration.target.points, AlignmentKind::kSimilarity) &&
         left_by_similarity(registration) < kMostOfIt * registration.initial_rms() / registration.original_rms();
}

// Change of the cost by an accurate integrator, in parts of it.
double change_of_cost(const matching::Registration& registration) {
  return registration.step_error ? registration.step_error->cost / std::max(registration.cost.total(), kNoCost) : 0;
}

bool is_drawn(const matching::Registration& registration) {
  return registration.mode == matching::MatchingMode::kPathwise ||
         registration.mode == matching::MatchingMode::kExpected;
}

// What to make of it; nothing where the path itself is no minimum yet.
std::string accuracy_remedy(const matching::Registration& registration) {
  if (!registration.converged) return {};
  if (registration.amplification.value_or(0) > kLargeAmplification && change_of_cost(registration) > kManySteps)
    return fmt::format(
        ": errors grow {:.0f}-fold along this path; trajectory.csv and warp follow it, but p0 shot by another "
        "integrator does not",
        *registration.amplification);
  if (make_integrator(registration.integrator)->traits().order < 2 && !is_drawn(registration))
    return ": try --integrator auto or more --steps";
  return ": try more --steps";
}

// The energy of mode map counts at t = 0 alone, and noise that draws landmarks together may lower it without end.
bool may_have_no_minimum(const matching::Registration& registration) {
  return registration.mode == matching::MatchingMode::kMap && !registration.converged &&
         registration_noise(registration)->traits().linear;
}

// Whether landmarks say less of their neighbours than nothing, as where they are paired at random.
bool neighbours_part(const matching::Registration& registration) {
  const auto found = matching::predict_match(registration);
  return found && found->predictions.error(found->doubted) > found->aligned.error(found->doubted);
}

bool is_interrupted(const matching::Registration& registration) {
  return registration.stop_reason == matching::kInterrupted;
}

// Why p0 cannot reach the target through noise that it does not choose.
std::string drawn_remedy(const matching::Registration& registration) {
  std::string moved;
  if (registration.spread.size() > 0) {
    const double spread =
        std::sqrt(registration.spread.squaredNorm() / static_cast<double>(registration.spread.cols()));
    moved = fmt::format("over the realisations a landmark ends {:.3g} ({} sigma) from its mean, rms", spread,
                        rounded(spread / registration.sigma));
  } else if (const auto& at_rest = registration.noise_displacement) {
    moved = fmt::format("this realisation moves a landmark at rest by {:.3g} ({} sigma), and no cheaper p0 undoes it",
                        *at_rest, rounded(*at_rest / registration.sigma));
  }
  const bool linear = registration_noise(registration)->traits().linear;
  return fmt::format("{}: try a smaller amplitude, or noise that is fitted: --mode {}", moved,
                     linear && !registration.uncertainty ? "metamorphosis" : "map");
}

// Of a search that ended early.
std::string search_remedy(const matching::Registration& registration) {
  if (registration.stop_reason.find("more steps") != std::string::npos) return "try more --steps";
  if (registration.stop_reason.find("limit of iterations") != std::string::npos) return "try more --max-iterations";
  return "try more --steps or --max-iterations";
}

// The likeliest remedy.
std::string remedy(const matching::Registration& registration) {
  if (is_interrupted(registration)) return "the search was interrupted";
  if (may_have_no_minimum(registration))
    return registration.uncertainty
               ? "mode map may have no minimum here: try a larger --lambda, or --mode metamorphosis without "
                 "--uncertainty"
               : "mode map may have no minimum here: try --mode metamorphosis, or a larger --lambda";
  if (should_align(registration))
    return fmt::format("try --align similarity, which leaves {:.0f} % of the distance",
                       100 * left_by_similarity(registration));
  const bool may_pass = !registration_noise(registration)->traits().diffeomorphic;
  const std::string noise = "try --noise ch-sd:beta=100%, position noise that lets landmarks pass each other";
  if (registration.source.dimension() == 1 && !may_pass)
    if (const int pairs = matching::order_inversions(registration.source.points, registration.target.points); pairs > 0)
      return fmt::format("{} a different order in the target, which no flow can reach: {}",
                         counted(pairs, "pair", pairs == 1 ? "of landmarks has" : "of landmarks have"), noise);
  if (!registration.matched() && neighbours_part(registration))
    return "neighbouring landmarks do not move together: check that landmarks correspond (if none do: --data "
           "varifold)" +
           (may_pass ? "" : "; or " + noise);
  if (registration.converged && is_drawn(registration)) return drawn_remedy(registration);
  if (!registration.converged) return search_remedy(registration) + (may_pass ? "" : "; or " + noise);
  return "try a smaller --sigma or --lambda" + (may_pass ? "" : "; for shapes that no flow can match " + noise);
}

// Which landmarks it is, where they are few.
std::string unmatched_text(const matching::Registration& registration) {
  const std::vector<int> unmatched = registration.unmatched_landmarks();
  if (unmatched.empty() || 2 * std::ssize(unmatched) > registration.source.count()) return {};
  return fmt::format(
      "{} {} too far from {} ({} sigma); ",
      (unmatched.size() == 1 ? "landmark " : "landmarks ") + landmark_list(registration.source, unmatched),
      unmatched.size() == 1 ? "is" : "are", unmatched.size() == 1 ? "its target" : "their targets",
      rounded(registration.residuals_over_sigma()(unmatched).maxCoeff()));
}

// "0.017 away, cost +3.1 %"
std::string end_of_shot(const matching::Registration& registration) {
  const double change = change_of_cost(registration);
  const std::string cost = change < 0.1 ? fmt::format("{:+.2g} %", 100 * change)
                           : change < 1 ? fmt::format("{:+.0f} %", 100 * change)
                                        : fmt::format("{:.{}f} times as large", 1 + change, change < 9 ? 1 : 0);
  return fmt::format("ends {:.3g} away, cost {}", registration.step_error->rms, cost);
}

bool follows_closely(const matching::Registration& registration) {
  const double near = std::max(kSmallDistance * diameter(registration.source.points), kSmallPart * registration.sigma);
  return registration.step_error && registration.step_error->rms <= near &&
         std::abs(change_of_cost(registration)) <= kSmallChange;
}

// Of momenta whose shot is not the result, where it ends elsewhere.
std::string lone_momenta_text(const matching::Registration& registration) {
  if (follows_closely(registration)) return {};
  const double growth = registration.amplification.value_or(0);
  return fmt::format(
      "p0 alone does not reproduce the path: shot by an accurate integrator, it {}{}. The path is the result: "
      "trajectory.csv, the pictures and warp follow it",
      registration.step_error ? fmt::format("ends {:.3g} away", registration.step_error->rms) : "leaves the path",
      growth > kLargeAmplification ? fmt::format(", as errors grow {}-fold", rounded(growth)) : "");
}

bool is_shot(const matching::Registration& registration) { return registration.states.empty(); }

}  // namespace

std::string accuracy_text(const matching::Registration& registration) {
  if (!is_shot(registration)) return lone_momenta_text(registration);
  if (!registration.step_error || follows_closely(registration)) return {};
  if (registration.extrapolated || is_drawn(registration))
    return registration.step_error->rms < diameter(registration.source.points)
               ? fmt::format("p0 is that of these steps: an accurate integrator ends {:.3g} away",
                             registration.step_error->rms)
               : std::string("p0 is that of these steps: an accurate integrator does not follow them");
  return "an accurate integrator " + end_of_shot(registration);
}

std::vector<std::string> path_warnings(const matching::Registration& registration) {
  std::vector<std::string> texts;
  if (!registration.matched())
    texts.push_back(fmt::format("not matched: {}rms {:.4g} is {} sigma and {} % of the distance before; {}",
                                unmatched_text(registration), registration.rms(),
                                rounded(registration.rms() / registration.sigma),
                                rounded(100 * registration.rms() / registration.initial_rms()), remedy(registration)));
  if (!registration.converged)
    texts.push_back(fmt::format(
        "not converged: {} after {}{}", registration.stop_reason, counted(registration.iterations, "iteration"),
        registration.matched() && !is_interrupted(registration) ? "; " + remedy(registration) : std::string()));
  return texts;
}

std::vector<std::string> momenta_warnings(const matching::Registration& registration) {
  std::vector<std::string> texts = path_warnings(registration);
  if (!is_shot(registration)) {
    if (std::string text = lone_momenta_text(registration); !text.empty()) texts.push_back(std::move(text));
  } else if (const auto& limit = registration.extrapolated) {
    const double left = limit->error / std::max(registration.cost.total(), kNoCost);
    if (left > kSmallChange)
      texts.push_back(fmt::format("J is known to {:.3g} % from these steps: try more --steps", 100 * left));
  } else if (std::abs(change_of_cost(registration)) > kSmallChange && !is_drawn(registration)) {
    texts.push_back(fmt::format("shot by an accurate integrator, p0 {}{}", end_of_shot(registration),
                                accuracy_remedy(registration)));
  }
  return texts;
}

std::vector<std::string> result_warnings(const matching::Registration& registration) {
  return is_shot(registration) ? momenta_warnings(registration) : path_warnings(registration);
}

}  // namespace pulson
