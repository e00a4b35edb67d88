#include "slicer_module.hpp"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <cmath>
#include <optional>
#include <string_view>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "help_groups.hpp"
#include "options.hpp"
#include "path_uses.hpp"
#include "printing.hpp"
#include "pulson/core/version.hpp"

namespace pulson {
namespace {

constexpr std::string_view kFlag = "--xml";

/// An option whose values Slicer knows better than its use of a file says.
struct SlicerType {
  std::string_view option;
  std::string_view element;  ///< with its attributes
};

constexpr std::string_view kPoints = R"(pointfile fileExtensions=".mrk.json,.fcsv" coordinateSystem="lps")";

struct SlicerModule {
  std::string_view verb;
  std::string_view title;
  std::string_view description;
  std::vector<SlicerType> types;
  std::vector<std::string_view> left_out;  ///< what is no matter of points
};

const std::vector<SlicerModule>& slicer_modules() {
  static const std::vector<SlicerModule> kModules = {
      {"register",
       "Pulson Register",
       "Fits the flow that carries the landmarks of a source onto those of a target (stochastic LDDMM), with noise as "
       "a "
       "control where no flow does. Results are in a folder; Pulson Warp Points moves other points by them.",
       {{"SOURCE", kPoints}, {"TARGET", kPoints}},
       {}},
      {"warp",
       "Pulson Warp Points",
       "Moves points by a registration of Pulson Register, and writes its map as a displacement field, which Slicer "
       "loads as a transform.",
       {{"REGISTRATION", R"(file fileExtensions=".json")"},
        {"INPUT", kPoints},
        {"--out", kPoints},
        {"--field", R"(transform type="nonlinear" fileExtensions=".nrrd")"}},
       {"--like",
        "--size",
        "--pixel-size",
        "--target-pixel-size",
        "--origin",
        "--target-origin",
        "--method",
        "--over",
        "--interpolation",
        "--border",
        "--background",
        "--supersampling",
        "--tolerance",
        "--max-pixels",
        "--grid",
        "--side-by-side",
        "--overlay",
        "--animate",
        "--numbers",
        "--width",
        "--dpi",
        "--samples",
        "--seed",
        "--jacobian",
        "--log-jacobian",
        "--multiplicity",
        "--displacement",
        "--folds",
        "--holes",
        "--deviation",
        "--fold-probability"}},
      {"atlas",
       "Pulson Atlas",
       "Estimates the template of a cohort and the momenta that carry it onto each specimen, with modes, regression "
       "and "
       "predicted missing landmarks. The cohort is a file of several shapes, such as a .mrk.json of several lists.",
       {},
       {}},
      {"audit",
       "Pulson Audit",
       "Lists which landmarks and specimens of a file look wrong, and how, and can write a mended copy.",
       {},
       {}}};
  return kModules;
}

const SlicerModule* find_module(const CLI::App& verb) {
  const auto& all = slicer_modules();
  const auto found = std::find_if(all.begin(), all.end(), [&](const auto& row) { return row.verb == verb.get_name(); });
  return found == all.end() ? nullptr : &*found;
}

// ---- a parameter

struct Parameter {
  std::string group;
  std::string xml;
};

std::string escaped(std::string_view text) {
  std::string result;
  for (const char c : text) {
    if (c == '&')
      result += "&amp;";
    else if (c == '<')
      result += "&lt;";
    else if (c == '>')
      result += "&gt;";
    else
      result += c;
  }
  return result;
}

bool is_switch(const CLI::Option& option) { return option.get_expected_min() == 0; }

bool is_list(const CLI::Option& option) { return option.get_delimiter() != '\0'; }

std::string option_name(const CLI::Option& option) {
  return option.get_lnames().empty() ? option.get_name(true) : "--" + option.get_lnames().front();
}

/// The type and the default that Slicer's panel begins with. A number or a choice without a default would be passed as
/// 0 or as an empty word, so it is text there, which is left out where it is empty.
struct SlicerValue {
  std::string element;  ///< with its attributes
  std::string default_value{};
  std::vector<std::string> choices{};
};

/// Without an exponent: Slicer shows as many decimals as there are here.
std::string plain_number(double number) {
  std::string digits(400, '\0');
  const auto end = std::to_chars(digits.data(), digits.data() + digits.size(), number, std::chars_format::fixed);
  digits.resize(static_cast<std::size_t>(end.ptr - digits.data()));
  return digits;
}

std::optional<double> number_in(const std::string& text) {
  double number = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), number);
  return error == std::errc() && end == text.data() + text.size() ? std::optional(number) : std::nullopt;
}

SlicerValue slicer_number(bool is_whole, const std::string& default_text) {
  constexpr double kMostInPanel = 2e7;  // beyond which Slicer's panel would change a whole number
  const std::optional<double> number = number_in(default_text);
  if (!number || (is_whole && std::abs(*number) > kMostInPanel)) return {"string", default_text};
  return {is_whole ? "integer" : "double", plain_number(*number)};
}

SlicerValue slicer_path(PathUse use) {
  switch (use) {
    case PathUse::kColumn:
      return {"string"};
    case PathUse::kFolder:
      return {"directory"};
    case PathUse::kFile:
    case PathUse::kShape:
    case PathUse::kResult:
    case PathUse::kBoth:
      break;
  }
  return {"file"};
}

SlicerValue slicer_value(const CLI::Option& option, const SlicerModule& module) {
  const std::string name = option_name(option), type = option.get_type_name();
  for (const SlicerType& row : module.types)
    if (row.option == name) return {std::string(row.element)};
  if (is_switch(option)) return {"boolean", "false"};
  // A shape that is an option may also be a word, such as `mean`.
  if (const auto use = path_use(&option))
    return use == PathUse::kShape && !option.get_positional() ? SlicerValue{"string"} : slicer_path(*use);
  const std::string default_text = option.get_default_str();
  if (is_list(option)) return {type == "NUMBERS" ? "double-vector" : "string-vector", default_text};
  if (std::vector<std::string> choices = known_values(option.get_name()); !choices.empty() && !default_text.empty()) {
    if (std::find(choices.begin(), choices.end(), default_text) == choices.end())
      choices.insert(choices.begin(), default_text);
    return {"string-enumeration", default_text, std::move(choices)};
  }
  const bool is_whole = type == "INT" || type == "UINT" || type == "COUNT";
  if (is_whole || type == "FLOAT" || type == "NUMBER") return slicer_number(is_whole, default_text);
  return {"string", default_text};
}

/// "No picture" of no-picture, "Source" of SOURCE.
std::string label_of(std::string name) {
  std::transform(name.begin(), name.end(), name.begin(),
                 [](unsigned char c) { return c == '-' ? ' ' : static_cast<char>(std::tolower(c)); });
  if (!name.empty()) name.front() = static_cast<char>(std::toupper(static_cast<unsigned char>(name.front())));
  return name;
}

std::string element_xml(const CLI::Option& option, const SlicerValue& value, const std::string& name,
                        const std::string& place) {
  std::string identifier = name;
  std::replace(identifier.begin(), identifier.end(), '-', '_');
  std::transform(identifier.begin(), identifier.end(), identifier.begin(),
                 [](unsigned char c) { return static_cast<char>(std::tolower(c)); });
  const auto line = [](std::string_view element, std::string_view text) {
    return fmt::format("      <{}>{}</{}>\n", element, escaped(text), element);
  };
  std::string text = fmt::format("    <{}>\n", value.element) + line("name", identifier) + place;
  text += line("description", option.get_description()) + line("label", label_of(name));
  if (!value.default_value.empty()) text += line("default", value.default_value);
  if (const auto use = path_use(&option); use && *use != PathUse::kColumn && !value.element.starts_with("string"))
    text += line("channel", *use == PathUse::kResult || *use == PathUse::kFolder ? "output" : "input");
  for (const std::string& choice : value.choices) text += line("element", choice);
  return text + fmt::format("    </{}>\n", value.element.substr(0, value.element.find(' ')));
}

std::vector<std::string> option_xml(const CLI::Option& option, const SlicerModule& module, int& index) {
  const SlicerValue value = slicer_value(option, module);
  if (option.get_positional())
    return {element_xml(option, value, option.get_name(true), fmt::format("      <index>{}</index>\n", index++))};
  std::vector<std::string> texts;
  const std::vector<std::string>& short_names = option.get_snames();
  for (const std::string& name : option.get_lnames()) {  // of a switch and its contrary, both
    std::string place;
    if (!short_names.empty() && name == option.get_lnames().front())
      place = fmt::format("      <flag>-{}</flag>\n", short_names.front());
    texts.push_back(element_xml(option, value, name, place + fmt::format("      <longflag>--{}</longflag>\n", name)));
  }
  return texts;
}

// ---- groups

/// In the order of the help, but results come last, and of them what is required: an option that takes several values
/// would take the arguments, too, if it stood before them.
std::string group_of(const CLI::Option& option) {
  const auto use = path_use(&option);
  if (use == PathUse::kFolder || (use == PathUse::kResult && option.get_required())) return "Results";
  return option.get_positional() ? "Input" : option.get_group();
}

std::string group_xml(const std::string& group, const std::vector<Parameter>& parameters) {
  const bool is_advanced = group.ends_with(kMore);
  const std::string label = is_advanced ? group.substr(0, group.size() - kMore.size()) : group;
  std::string text = fmt::format("  <parameters{}>\n    <label>{}{}</label>\n    <description>{}</description>\n",
                                 is_advanced ? " advanced=\"true\"" : "", escaped(label), is_advanced ? " (more)" : "",
                                 escaped(label));
  for (const Parameter& parameter : parameters)
    if (parameter.group == group) text += parameter.xml;
  return text + "  </parameters>\n";
}

}  // namespace

std::string slicer_module_xml(const CLI::App& verb) {
  const SlicerModule& module = *find_module(verb);
  std::vector<Parameter> parameters;
  std::vector<std::string> groups{"Input"};
  int index = 0;
  for (const CLI::Option* option : verb.get_options()) {
    const auto is_left_out = [&](std::string_view name) { return name == option_name(*option); };
    if (!option->get_configurable() || std::any_of(module.left_out.begin(), module.left_out.end(), is_left_out))
      continue;
    const std::string group = group_of(*option);
    if (group != "Results" && std::find(groups.begin(), groups.end(), group) == groups.end()) groups.push_back(group);
    for (std::string& xml : option_xml(*option, module, index)) parameters.push_back({group, std::move(xml)});
  }
  groups.emplace_back("Results");
  std::string text = fmt::format(
      "<?xml version=\"1.0\" encoding=\"utf-8\"?>\n<executable>\n  <category>Registration.Pulson</category>\n"
      "  <title>{}</title>\n  <description>{}</description>\n  <version>{}</version>\n"
      "  <license>Apache-2.0</license>\n  <contributor>the authors of pulson</contributor>\n",
      module.title, escaped(module.description), version());
  for (const std::string& group : groups) text += group_xml(group, parameters);
  return text + "</executable>\n";
}

void add_slicer_option(CLI::App& verb) {
  if (find_module(verb) == nullptr) return;
  verb.add_flag_callback(
          std::string(kFlag),
          [&verb] {
            print_exact(slicer_module_xml(verb));
            throw CLI::Success();
          },
          "print this verb as a module of 3D Slicer (Slicer Execution Model) and exit")
      ->configurable(false);
}

}  // namespace pulson
