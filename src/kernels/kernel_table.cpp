#include <algorithm>
#include <array>
#include <cassert>
#include <cmath>
#include <cstddef>
#include <numbers>
#include <utility>

#include <fmt/core.h>

#include "own_kernels.hpp"
#include "pair_sums.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {

namespace {

RadialJet gaussian(double alpha, double s) {
  const double c = -1 / (alpha * alpha);
  const double k = std::exp(c * s);
  return {k, 2 * c * k, 4 * c * c * k};
}

RadialJet peakon(double alpha, double s) {
  const double c = -1 / alpha;
  const double r = std::sqrt(s);
  const double k = std::exp(c * r);
  if (r == 0) return {k, 0, 0};
  const double first = c * k / r;
  return {k, first, first / r * (c - 1 / r)};
}

// Where exp(t) is 0 already, so that no polynomial in t overflows beside it.
constexpr double kLeastExponent = -1000;

RadialJet matern32(double alpha, double s) {
  const double c = -std::sqrt(3.0) / alpha;
  const double r = std::sqrt(s);
  const double t = std::max(c * r, kLeastExponent);
  const double e = std::exp(t);
  const double first = -c * c * e;
  return {(1 - t) * e, first, r == 0 ? 0 : c * first / r};
}

RadialJet matern52(double alpha, double s) {
  const double c = -std::sqrt(5.0) / alpha;
  const double t = std::max(c * std::sqrt(s), kLeastExponent);
  const double e = std::exp(t);
  const double third = c * c / 3;
  return {(1 - t + t * t / 3) * e, -third * (1 - t) * e, third * c * c * e};
}

}  // namespace

std::span<const ProfileFacts> kernel_profiles() {
  using std::numbers::e;
  using std::numbers::phi;
  static const std::array kFacts = {
      ProfileFacts{KernelProfile::kGaussian, "gaussian", "exp(-r^2/alpha^2): smooth fields, the usual choice",
                   std::sqrt(2 / e), gaussian},
      ProfileFacts{KernelProfile::kPeakon, "peakon",
                   "exp(-r/alpha): Camassa-Holm's kernel; fields have a kink at each landmark", 1, peakon},
      ProfileFacts{KernelProfile::kMatern32, "matern32",
                   "(1 + x) exp(-x), x = sqrt(3) r/alpha: Sobolev kernel, fields twice differentiable; for fine detail "
                   "and dense landmarks",
                   std::sqrt(3.0) / e, matern32},
      ProfileFacts{
          KernelProfile::kMatern52, "matern52",
          "(1 + x + x^2/3) exp(-x), x = sqrt(5) r/alpha: Sobolev kernel, fields four times differentiable; for "
          "dense landmarks where gaussian's matrix is nearly singular",
          std::sqrt(5.0) / 3 * phi * phi * phi * std::exp(-phi), matern52},
  };
  return kFacts;
}

const ProfileFacts& facts_of(KernelProfile profile) {
  const ProfileFacts& facts = kernel_profiles()[static_cast<std::size_t>(profile)];
  assert(facts.profile == profile);
  return facts;
}

MakeKernelTerm term_maker(KernelProfile profile) {
  return [profile](const Parameters& given, double automatic) {
    return KernelTerm{profile, given.is_auto("alpha") ? automatic : given.positive("alpha"), given.positive("weight")};
  };
}

const NameTable<MakeKernelTerm>& kernel_table() {
  static const NameTable<MakeKernelTerm> kTable = [] {
    const std::vector<ParameterInfo> parameters = {
        {"alpha", "auto",
         "width, length units, or 30%: of the diameter; auto: half the median distance, at most 2 median distances to "
         "the nearest landmark",
         true},
        {"weight", "1", "factor of this term in a sum"}};
    std::vector<NameTable<MakeKernelTerm>::Row> rows;
    for (const ProfileFacts& facts : kernel_profiles())
      rows.push_back({std::string(facts.name), parameters, std::string(facts.help), term_maker(facts.profile)});
    return NameTable<MakeKernelTerm>("kernel", std::move(rows));
  }();
  return kTable;
}

double automatic_alpha(const Points& source) {
  return std::min(0.5 * median_distance(source), 2 * median_nearest_distance(source));
}

KernelOperator make_kernel(std::string_view spec, const Points& source) {
  std::vector<KernelTerm> terms;
  const NameTable<MakeKernelTerm> table = table_with_own_kernels();
  const double size = spec.find('%') == std::string_view::npos ? 0 : diameter(source);
  for (const auto& [row, parameters] : table.parse(spec, size)) {
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
    const std::string name =
        is_own(term.profile) ? own_kernel_name(term.profile) : std::string(facts_of(term.profile).name);
    text += fmt::format("{}{}:alpha={}", text.empty() ? "" : "+", name, number(term.alpha));
    if (term.weight != 1) text += ",weight=" + number(term.weight);
  }
  return text;
}

}  // namespace pulson
