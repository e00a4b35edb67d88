// Shapes about a template, by their scores.

#include <algorithm>
#include <cmath>

#include "html_numbers.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::html {
namespace {

void check_space(const ReportShapeSpace& space) {
  const auto check = [](bool holds, const char* message) {
    if (!holds) throw InputError(std::string("report: ") + message);
  };
  const std::size_t count = space.axes.size();
  check(count > 0 && space.range > 0, "a space of shapes needs a score and a range");
  check(!space.terms.empty() && space.powers.size() == space.terms.size(),
        "a space of shapes has other powers than terms");
  check(space.grid_terms.empty() || space.grid_terms.size() == space.terms.size(),
        "a space of shapes has other terms for its grid");
  for (const std::vector<int>& powers : space.powers)
    check(powers.size() == count, "a space of shapes has other powers than scores");
  for (const Points& term : space.terms)
    check(term.rows() == space.shapes.source.dimension() && term.cols() == space.shapes.source.count() &&
              term.allFinite(),
          "a term of a space of shapes is not of its template");
  for (const Points& term : space.grid_terms)
    check(!space.shapes.grid.empty() && term.cols() == space.shapes.grid.front().cols() && term.allFinite(),
          "a term of a space of shapes is not of its grid");
  for (const ReportShapeSpace::Specimen& specimen : space.specimens)
    check(specimen.scores.size() == count, "a specimen of a space of shapes has other scores");
}

// Names of the groups in their order; none where there is none.
std::vector<std::string> groups_of(const ReportShapeSpace& space) {
  std::vector<std::string> groups;
  for (const ReportShapeSpace::Specimen& specimen : space.specimens)
    if (!specimen.group.empty() && std::find(groups.begin(), groups.end(), specimen.group) == groups.end())
      groups.push_back(specimen.group);
  return groups;
}

std::string quoted_list(const std::vector<std::string>& texts) {
  std::string list = "[";
  for (const std::string& text : texts) {
    list += list.size() > 1 ? ",\"" : "\"";
    append_json_text(list, text);
    list += '"';
  }
  return list + "]";
}

std::string specimens_of(const ReportShapeSpace& space, const std::vector<std::string>& groups) {
  std::string list = "[";
  for (const ReportShapeSpace::Specimen& specimen : space.specimens) {
    if (list.size() > 1) list += ',';
    list += R"({"name":")";
    append_json_text(list, specimen.name);
    const auto group = std::find(groups.begin(), groups.end(), specimen.group) - groups.begin();
    fmt::format_to(std::back_inserter(list), R"(","group":{},"scores":[{:.3g}])", group,
                   fmt::join(specimen.scores, ","));
    if (specimen.picture)
      fmt::format_to(std::back_inserter(list), R"(,"picture":"{}")", data_address(*specimen.picture));
    list += '}';
  }
  return list + "]";
}

std::string sliders_of(const ReportShapeSpace& space) {
  std::string text = "<div class=\"scores\">";
  for (std::size_t k = 0; k < space.axes.size(); ++k)
    text += fmt::format(
        "<label><span>{}</span><input type=\"range\" min=\"{:.0f}\" max=\"{:.0f}\" value=\"0\" "
        "data-score=\"{}\" /><output></output></label>",
        escaped(space.axes[k]), -100 * space.range, 100 * space.range, k);
  return text + "</div>\n";
}

std::string names_of(const ReportShapeSpace& space) {
  std::string text = R"(<label class="pick">shape <select><option value="">by its scores</option>)";
  for (std::size_t i = 0; i < space.specimens.size(); ++i)
    text += fmt::format("<option value=\"{}\">{}</option>", i, escaped(space.specimens[i].name));
  return text + "</select></label>";
}

}  // namespace

std::string shape_space(const ReportShapeSpace& space) {
  check_sizes(space.shapes);
  check_space(space);
  const std::vector<std::string> groups = groups_of(space);
  const ReportMotion& shapes = space.shapes;
  std::string text = fmt::format(
      "<figure class=\"motion space\" hidden=\"\">\n<div class=\"pair\"><div><canvas role=\"img\" aria-label=\"shape "
      "of "
      "{} landmarks in {}D by its scores\" tabindex=\"0\"></canvas></div><div><svg class=\"map\" role=\"img\" "
      "aria-label=\"map of the scores of {} shapes\" viewBox=\"0 0 420 420\"></svg><ul "
      "class=\"groups\"></ul></div></div>\n",
      shapes.source.count(), shapes.source.dimension(), space.specimens.size());
  text += sliders_of(space);
  text += R"(<div class="player"><button type="button">Play</button>)" + names_of(space) +
          R"(<button type="button" data-reset="">Mean</button>)" + zoom_buttons() + "</div>\n";
  text += key_of(shapes);
  if (shapes.image) text += fmt::format("<img hidden=\"\" src=\"{}\" alt=\"\">\n", data_address(shapes.image->picture));
  if (!space.caption.empty()) text += "<figcaption>" + escaped(space.caption) + "</figcaption>\n";
  const Box box = box_of(shapes);
  Json json(box);
  add_motion(shapes, 1, json);
  std::string powers = "[";
  for (const std::vector<int>& of_term : space.powers)
    fmt::format_to(std::back_inserter(powers), "{}[{}]", powers.size() > 1 ? "," : "", fmt::join(of_term, ","));
  json.add("powers", powers + "]");
  json.add_terms("terms", space.terms);
  json.add_terms("gridTerms", space.grid_terms);
  json.add("axes", quoted_list(space.axes));
  json.add("range", fmt::format("{:.6g}", space.range));
  json.add("groupNames", quoted_list(groups));
  json.add("specimens", specimens_of(space, groups));
  return text + "<script type=\"application/json\">" + std::move(json).finished() + "</script>\n</figure>\n";
}

}  // namespace pulson::html
