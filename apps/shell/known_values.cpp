#include "known_values.hpp"

#include <algorithm>
#include <map>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson {
namespace {

std::vector<std::string> names_of_formats() {
  std::vector<std::string> names;
  for (const LandmarkFormat& format : landmark_formats()) names.push_back(format.name);
  return names;
}

}  // namespace

const std::vector<std::string>& known_values(const std::string& option) {
  static const std::map<std::string, std::vector<std::string>> kValues = {
      {"--mode", {"deterministic", "metamorphosis", "map", "pathwise", "expected"}},
      {"--data", {"landmarks", "varifold", "current"}},
      {"--curve-ends", {"auto", "closed", "open"}},
      {"--align", {"none", "translation", "rigid", "similarity", "affine"}},
      {"--solver", {"auto", "paths", "gauss-newton", "lbfgs"}},
      {"--missing", {"negative"}},
      {"--format", names_of_formats()},
      {"--dim", {"2", "3"}},
      {"--scale", {"apply"}},
      {"--axes", {"LPS", "RAS"}},
      {"--from-axes", {"LPS", "RAS"}},
      {"--labels", {"metric", "thin-plate"}},
      {"--method", {"auto", "pull", "push"}},
      {"--over", {"least-stretched", "first", "label-order", "average"}},
      {"--interpolation", {"nearest", "linear", "cubic", "lanczos", "label"}},
      {"--border", {"auto", "transparent", "constant", "replicate", "reflect"}}};
  static const std::vector<std::string> kNone;
  const auto found = kValues.find(option);
  return found == kValues.end() ? kNone : found->second;
}

CLI::Option* only_known(CLI::Option* option, const std::string& what, const std::vector<std::string>& more) {
  std::vector<std::string> valid = more;
  const std::vector<std::string>& known = known_values(option->get_name());
  valid.insert(valid.end(), known.begin(), known.end());
  return option->check([what, valid](const std::string& text) {
    if (std::find(valid.begin(), valid.end(), text) == valid.end())
      throw InputError(fmt::format("unknown {} '{}'{}", what, text, advice_on_name(text, valid)));
    return std::string();
  });
}

}  // namespace pulson
