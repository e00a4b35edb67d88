#include "coefficient_picture.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "draw/shape_panels.hpp"
#include "pulson/core/alignment.hpp"

namespace pulson {
namespace {

constexpr std::size_t kMostRows = 12;
constexpr double kLongest = 0.15;  // of the diameter, of a displacement as it is drawn

// 1, 2, 5, 10, …: the largest one that leaves displacements within the longest.
double magnification(double longest, double diameter) {
  if (!(longest > 0)) return 1;
  const double most = kLongest * diameter / longest;
  const double power = std::pow(10, std::floor(std::log10(most)));
  const double factor = most >= 5 * power ? 5 * power : most >= 2 * power ? 2 * power : power;
  return std::max(factor, 1.0);
}

double longest_of(const Points& displacements) { return displacements.colwise().norm().maxCoeff(); }

// "log(size), + 1 s.d. (0.0713)" or "speciesTeyah"
std::string change_text(const cohort::ModelDesign& design, std::size_t c) {
  const double deviation = design.deviations[static_cast<Eigen::Index>(c)];
  if (deviation == 1) return design.names[c];
  return fmt::format("{}, + 1 s.d. ({:.3g})", design.names[c], deviation);
}

}  // namespace

void draw_coefficients(const AtlasResults& results, const draw::PictureFiles& files) {
  const cohort::Atlas& atlas = results.atlas;
  const Points& q0 = atlas.template_shape.points;
  const Eigen::MatrixXd metric = atlas.metric();
  // Procrustes coordinates as the template lies.
  const std::vector<int>& common = results.procrustes.landmarks;
  const Alignment onto_template = align(results.procrustes.mean, q0(Eigen::all, common), AlignmentKind::kSimilarity);
  draw::ShapePanels picture{.reference = atlas.template_shape,
                            .reference_name = "template",
                            .shape_name = "template and displacement, magnified",
                            .cloud_name = {},
                            .rows = {},
                            .title = "Coefficients of the linear model",
                            .subtitle = {}};
  std::size_t count = 0;
  for (const ShapeModel& model : results.models)
    for (std::size_t c = 0; c < model.design.names.size(); ++c) {
      if (++count > kMostRows) continue;
      const double change = model.design.deviations[static_cast<Eigen::Index>(c)];
      Points of_procrustes = Points::Zero(q0.rows(), q0.cols());
      of_procrustes(Eigen::all, common) =
          change * onto_template.scale * onto_template.linear * model.procrustes_coefficients[c];
      const Points of_momenta = change * model.momenta_coefficients[c] * metric;
      const double factor = magnification(std::max(longest_of(of_procrustes), longest_of(of_momenta)), diameter(q0));
      const std::string text = change_text(model.design, c);
      picture.rows.push_back({{fmt::format("{}: Procrustes × {:g}", text, factor), q0 + factor * of_procrustes},
                              {fmt::format("{}: momenta × {:g}", text, factor), q0 + factor * of_momenta}});
    }
  picture.subtitle = fmt::format("difference per coefficient, the others held{}",
                                 count > kMostRows ? fmt::format("  ·  the first {} of {}", kMostRows, count) : "");
  write_shape_panels(picture, files);
}

}  // namespace pulson
