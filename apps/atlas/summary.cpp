#include <algorithm>

#include <fmt/format.h>

#include "results.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"

namespace pulson {
namespace {

std::string origin(bool fitted) { return fitted ? " (fitted)" : ""; }

std::string shares(const cohort::ShapeModes& modes) {
  std::vector<std::string> texts;
  for (Eigen::Index k = 0; k < std::min<Eigen::Index>(3, modes.eigenvalues.size()); ++k)
    texts.push_back(fmt::format("{:.1f} %", 100 * modes.eigenvalues[k] / modes.total()));
  if (texts.empty()) return "none: the shapes are all the same";
  return fmt::format("{} of the variance", fmt::join(texts, ", "));
}

// Of all shapes; the notes have their names.
void print_suspects(const cohort::Atlas& atlas) {
  if (atlas.loss.empty()) return;
  std::int64_t landmarks = 0, shapes = 0;
  for (const cohort::AtlasSpecimen& specimen : atlas.specimens) {
    landmarks += std::ssize(specimen.suspects());
    shapes += specimen.suspects().empty() ? 0 : 1;
  }
  print_text(
      "suspects    {}, by loss {}\n",
      landmarks == 0 ? "none" : fmt::format("{} of {}", counted(landmarks, "landmark"), counted(shapes, "shape")),
      atlas.loss);
}

}  // namespace

void print_atlas(const AtlasResults& results) {
  const cohort::Atlas& atlas = results.atlas;
  const Landmarks& shape = atlas.template_shape;
  std::vector<double> rms;
  for (const cohort::AtlasSpecimen& specimen : atlas.specimens) rms.push_back(specimen.rms());
  std::sort(rms.begin(), rms.end());
  print_text("template    of {}: {} in {}D, {} iterations, {}\n", counted(std::ssize(atlas.specimens), "shape"),
             counted(shape.count(), "landmark"), shape.dimension(), atlas.iterations,
             atlas.converged ? "converged" : "NOT CONVERGED");
  print_text("model       {}{}, lambda {:.4g}{}, sigma {:.4g}{}, {} in {} steps\n", atlas.kernel.spec(4),
             origin(atlas.fitted_kernel), atlas.lambda, origin(atlas.fitted_lambda), atlas.sigma,
             origin(atlas.fitted_sigma), matching::atlas_defaults().integrator.value, atlas.steps);
  print_suspects(atlas);
  print_text("rms         median {:.4g}, largest {:.4g}; exp(log) error {:.2g} diameters\n", rms[rms.size() / 2],
             rms.back(), atlas.exp_log_error());
  print_text("modes       {}; of Procrustes coordinates {}\n", shares(results.modes), shares(results.procrustes.modes));
  print_models(results);
  if (!results.predicted.empty()) {
    std::int64_t count = 0;
    for (const cohort::PredictedLandmarks& predicted : results.predicted) count += std::ssize(predicted.landmarks);
    print_text("predicted   {}, with bands of 90 %\n", counted(count, "missing landmark"));
  }
  print_text("time        {:.2f} s\n", results.seconds);
}

}  // namespace pulson
