#include <algorithm>

#include <fmt/core.h>

#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {
namespace {

template <KernelProfile profile>
KernelTerm make_term(const Parameters& parameters, double automatic) {
  return {profile, parameters.is_auto("alpha") ? automatic : parameters.positive("alpha"),
          parameters.positive("weight")};
}

std::string_view profile_name(KernelProfile profile) {
  return profile == KernelProfile::kGaussian ? "gaussian" : "peakon";
}

}  // namespace

const NameTable<MakeKernelTerm>& kernel_table() {
  static const std::vector<ParameterInfo> kParameters = {
      {"alpha", "auto",
       "width, length units; auto: half the median distance, at most 2 median distances to the nearest landmark"},
      {"weight", "1", "factor of this term in a sum"}};
  static const NameTable<MakeKernelTerm> kTable(
      "kernel", {{"gaussian", kParameters, "exp(-r^2/alpha^2): smooth fields, the usual choice",
                  make_term<KernelProfile::kGaussian>},
                 {"peakon", kParameters, "exp(-r/alpha): Camassa-Holm's kernel; fields have a kink at each landmark",
                  make_term<KernelProfile::kPeakon>}});
  return kTable;
}

double automatic_alpha(const Points& source) {
  return std::min(0.5 * median_distance(source), 2 * median_nearest_distance(source));
}

KernelOperator make_kernel(std::string_view spec, const Points& source) {
  std::vector<KernelTerm> terms;
  for (const auto& [row, parameters] : kernel_table().parse(spec)) {
    const double automatic = parameters.is_auto("alpha") ? automatic_alpha(source) : 0;
    if (parameters.is_auto("alpha") && !(automatic > 0))
      throw InputError("kernel '" + row->name + "': alpha=auto needs at least two landmarks apart; give a number");
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
    text += fmt::format("{}{}:alpha={}", text.empty() ? "" : "+", profile_name(term.profile), number(term.alpha));
    if (term.weight != 1) text += ",weight=" + number(term.weight);
  }
  return text;
}

}  // namespace pulson
