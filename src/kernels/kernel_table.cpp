#include <algorithm>
#include <utility>

#include <fmt/core.h>

#include "kernel_profiles.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

const NameTable<MakeKernelTerm>& kernel_table() {
  static const NameTable<MakeKernelTerm> kTable = [] {
    const std::vector<ParameterInfo> parameters = {
        {"alpha", "auto",
         "width, length units, or 30%: of the diameter; auto: half the median distance, at most 2 median distances to "
         "the nearest landmark",
         true},
        {"weight", "1", "factor of this term in a sum"}};
    std::vector<NameTable<MakeKernelTerm>::Row> rows;
    for (const ProfileFacts& facts : kernel_profiles()) {
      const auto make = [profile = facts.profile](const Parameters& given, double automatic) {
        return KernelTerm{profile, given.is_auto("alpha") ? automatic : given.positive("alpha"),
                          given.positive("weight")};
      };
      rows.push_back({std::string(facts.name), parameters, std::string(facts.help), make});
    }
    return NameTable<MakeKernelTerm>("kernel", std::move(rows));
  }();
  return kTable;
}

double automatic_alpha(const Points& source) {
  return std::min(0.5 * median_distance(source), 2 * median_nearest_distance(source));
}

KernelOperator make_kernel(std::string_view spec, const Points& source) {
  std::vector<KernelTerm> terms;
  const double size = spec.find('%') == std::string_view::npos ? 0 : diameter(source);
  for (const auto& [row, parameters] : kernel_table().parse(spec, size)) {
    const double automatic = parameters.is_auto("alpha") ? automatic_alpha(source) : 0;
    if (parameters.is_auto("alpha") && !(automatic > 0))
      throw InputError("kernel '" + row->name + "': alpha=auto needs at least two distinct landmarks; give a number");
    terms.push_back(row->make(parameters, automatic));
  }
  return KernelOperator(std::move(terms));
}

std::string KernelOperator::spec(int digits) const {
  const auto number = [digits](double value) {
    return digits >= 17 ? fmt::format("{}", value) : fmt::format("{:.{}g}", value, digits);
  };
  std::string text;
  for (const KernelTerm& term : terms_) {
    text += fmt::format("{}{}:alpha={}", text.empty() ? "" : "+", facts_of(term.profile).name, number(term.alpha));
    if (term.weight != 1) text += ",weight=" + number(term.weight);
  }
  return text;
}

}  // namespace pulson
