#include "verdict_texts.hpp"

#include <algorithm>

#include <fmt/core.h>

#include "pulson/core/name_table.hpp"
#include "shell/messages.hpp"

namespace pulson {
namespace {

using matching::PredictionWord;

constexpr std::size_t kMostListed = 8;

std::string joined(const std::vector<std::string>& parts) {
  std::string text;
  for (std::size_t i = 0; i < std::min(parts.size(), kMostListed); ++i) text += (i == 0 ? "" : ", ") + parts[i];
  return parts.size() > kMostListed ? text + ", …" : text;
}

std::string landmarks_text(const Landmarks& shape, const std::vector<int>& landmarks) {
  return (landmarks.size() == 1 ? "landmark " : "landmarks ") + landmark_list(shape, landmarks);
}

std::string doubts_text(const Landmarks& shape, const matching::LandmarkVerdicts& verdicts) {
  const std::vector<int>& doubted = verdicts.doubted();
  const double most = verdicts.predicted(doubted).maxCoeff();
  return fmt::format("{} {} not where the others predict {}: {}{:.3g} standard deviations, {:.2g} expected at most",
                     landmarks_text(shape, doubted), doubted.size() == 1 ? "is" : "are",
                     doubted.size() == 1 ? "it" : "them", doubted.size() == 1 ? "" : "up to ", most,
                     verdicts.prediction->limit);
}

std::string word_text(const Landmarks& shape, const records::RegistrationFacts& facts) {
  switch (facts.verdicts.word) {
    case PredictionWord::kNoCommonPart:
      return "no better than without the other landmarks";
    case PredictionWord::kDoubted:
      return doubts_text(shape, facts.verdicts);
    default:
      return facts.finding.empty() ? "each landmark is where the others predict it"
                                   : "good, but no landmark is cleared: see the warning";
  }
}

std::string flipped_text(const matching::Registration& registration, const records::TopologyCounts& counts) {
  const auto& flips = *counts.target_flips;
  if (flips.empty()) return {};
  std::vector<int> corners;
  for (const std::array<int, 3>& triangle : flips) corners.insert(corners.end(), triangle.begin(), triangle.end());
  std::sort(corners.begin(), corners.end());
  corners.erase(std::unique(corners.begin(), corners.end()), corners.end());
  return fmt::format("the target itself flips {} between {}", counted(std::ssize(flips), "triangle"),
                     landmarks_text(registration.source, corners));
}

}  // namespace

std::string landmark_list(const Landmarks& shape, const std::vector<int>& landmarks) {
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < landmarks.size();) {
    std::size_t end = i + 1;
    while (shape.labels.empty() && end < landmarks.size() &&
           shape.number(landmarks[end]) == shape.number(landmarks[end - 1]) + 1)
      ++end;
    if (end - i >= 3) {
      parts.push_back(fmt::format("{}–{}", shape.number(landmarks[i]), shape.number(landmarks[end - 1])));
      i = end;
    } else {
      parts.push_back(shape.describe(landmarks[i++]));
    }
  }
  return joined(parts);
}

std::string prediction_text(const matching::Registration& registration, const records::RegistrationFacts& facts) {
  if (registration.data.kind != matching::DataKind::kLandmarks) return {};
  const auto& prediction = facts.verdicts.prediction;
  if (!prediction) return fmt::format("undetermined: it takes {} landmarks", matching::kFewestPredicted);
  return fmt::format("leave-one-out error {:.3g} ({}: {:.3g}): {}", prediction->predictions.error(),
                     registration.alignment.kind == AlignmentKind::kNone ? "at rest" : "alignment alone",
                     prediction->aligned.error(), word_text(registration.source, facts));
}

std::string prediction_note(const records::RegistrationFacts& facts) {
  if (facts.verdicts.word != PredictionWord::kNoCommonPart || !facts.finding.empty()) return {};
  const std::string text = "the landmarks' displacements have no common smooth part";
  return facts.verdicts.may_be_unordered ? text + ": is their order right?" : text;
}

std::string place_of_noise(const matching::Registration& registration, const records::RegistrationFacts& facts) {
  const std::vector<int>& where = facts.verdicts.concentrated;
  if (where.empty()) return {};
  return fmt::format("not diffeomorphic here: {} ({:.0f} % of the action)", landmarks_text(registration.source, where),
                     100 * facts.verdicts.concentrated_share());
}

std::string topology_of_target(const matching::Registration& registration, const records::RegistrationFacts& facts) {
  const records::TopologyCounts& counts = facts.counts;
  if (counts.target_flips) return flipped_text(registration, counts);
  if (!counts.target_inversions) return {};
  if (*counts.target_inversions == 0) return "the target has the order of the source";
  return fmt::format("the target's order differs in {}; the path exchanges {} of them",
                     counted(*counts.target_inversions, "pair", "of landmarks"), *counts.exchanged_as_target);
}

bool flips_matter(const matching::Registration& registration, const records::RegistrationFacts& facts) {
  return registration.noise != "none" || !facts.finding.empty() || facts.verdicts.word != PredictionWord::kPredicted;
}

}  // namespace pulson
