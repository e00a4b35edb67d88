#include "compare/weights.hpp"

#include <fmt/core.h>

#include "core/text.hpp"
#include "pulson/cohort/atlas.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {

void weigh(const matching::RobustLoss& loss, compare::CohortShapes& shapes, std::vector<std::string>& notes) {
  constexpr std::size_t kFewest = 3;
  if (shapes.targets.size() < kFewest)
    throw InputError(fmt::format("a loss weighs landmarks by what other shapes predict, and there {}; it takes {}",
                                 shapes.targets.size() == 1 ? "is one" : "are two", kFewest));
  cohort::AtlasOptions options;
  options.loss = loss;
  options.align = shapes.alignment == AlignmentKind::kAffine ? AlignmentKind::kSimilarity : shapes.alignment;
  const cohort::Atlas atlas = cohort::make_atlas(shapes.targets, options);
  shapes.weights.clear();
  for (std::size_t i = 0; i < shapes.targets.size(); ++i) {
    const cohort::AtlasSpecimen& specimen = atlas.specimens[i];
    shapes.weights.push_back(specimen.precisions);
    const std::vector<int> suspects = specimen.suspects();
    if (suspects.empty()) continue;
    notes.push_back(matching::note_of_suspects(shapes.targets[i], suspects));
    for (const int a : suspects) shapes.targets[i].points.col(a).setConstant(text::kMissing);
  }
}

}  // namespace pulson
