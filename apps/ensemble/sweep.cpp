#include "sweep.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/spec_text.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson {
namespace {

constexpr std::size_t kMostValues = 1000;

std::vector<double> range_values(double from, double to, double step, const std::string& option) {
  constexpr double kRounding = 1e-9;  // of a step: 0:0.3:0.1 ends at 0.3
  const double steps = (to - from) / step;
  if (!(step > 0 && steps >= 0 && steps < static_cast<double>(kMostValues)))
    throw InputError(fmt::format("{} goes from {} to {} in steps of {}; it must go up, in fewer than {} steps", option,
                                 from, to, step, kMostValues));
  std::vector<double> values;
  const auto last = static_cast<int>(std::floor(steps + kRounding));
  for (int i = 0; i <= last; ++i) values.push_back(std::abs(steps - i) < kRounding ? to : from + i * step);
  return values;
}

bool is_named(const std::string& asked, const std::string& term, const std::string& key) {
  return asked == key || asked == term + "." + key;
}

std::string joined(const std::vector<Spec>& terms) {
  std::string text;
  for (const Spec& term : terms) text += (text.empty() ? "" : "+") + text_of_spec(term);
  return text;
}

// What of a term can be swept.
std::vector<std::string> keys_of(const Spec& term, bool of_kernel, const Landmarks& shape) {
  if (of_kernel) return {"alpha", "weight"};
  return make_noise(text_of_spec(term), shape)->parameter_names();
}

}  // namespace

std::vector<double> parse_values(std::string_view text, const std::string& option) {
  std::vector<double> values;
  const std::vector<std::string_view> range = split(text, ':');
  for (const std::string_view part : range.size() == 3 ? range : split(text, ','))
    values.push_back(parse_number(part, option));
  if (!std::all_of(values.begin(), values.end(), [](double value) { return std::isfinite(value); }))
    throw InputError(fmt::format("{} is {}; its values must be finite", option, quoted_line(text)));
  if (range.size() == 3) return range_values(values[0], values[1], values[2], option);
  std::sort(values.begin(), values.end());
  if (const auto twice = std::adjacent_find(values.begin(), values.end()); twice != values.end())
    throw InputError(fmt::format("{} has the value {} twice", option, *twice));
  if (values.size() > kMostValues)
    throw InputError(fmt::format("{} has {} values; the most are {}", option, values.size(), kMostValues));
  return values;
}

SweepValues parse_sweep(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == 0 || equals == std::string::npos)
    throw InputError(fmt::format("--sweep is {}; it must be NAME=from:to:step or NAME=a,b,c, as in beta=0:6.5:0.25",
                                 quoted_line(text)));
  const std::string parameter = text.substr(0, equals);
  return {parameter, parse_values(std::string_view(text).substr(equals + 1), "--sweep " + parameter)};
}

std::string with_parameter(const std::string& noise, const std::string& parameter) {
  std::vector<Spec> terms = parse_spec_sum(noise, "noise");
  for (Spec& term : terms)
    for (const ParameterInfo& info : noise_table().find(term.name).parameters)
      if (info.default_text.empty() && is_named(parameter, term.name, info.name)) term.values.emplace(info.name, "1");
  return joined(terms);
}

SweptParameter::SweptParameter(const std::string& name, const StochasticSystem& system, const Landmarks& shape)
    : system_(system), shape_(shape), of_kernel_(name.starts_with("kernel.")) {
  const std::string asked = of_kernel_ ? name.substr(std::string_view("kernel.").size()) : name;
  const std::string owner = of_kernel_ ? "kernel." : "";
  terms_ = of_kernel_ ? parse_spec_sum(system.kernel.spec(), "kernel") : parse_spec_sum(system.noise->spec(), "noise");
  std::vector<std::string> found, valid;
  for (std::size_t i = 0; i < terms_.size(); ++i)
    for (const std::string& key : keys_of(terms_[i], of_kernel_, shape)) {
      const std::string full =
          terms_.size() > 1 ? fmt::format("{}{}.{}", owner, terms_[i].name, key) : fmt::format("{}{}", owner, key);
      valid.push_back(full);
      if (!is_named(asked, terms_[i].name, key)) continue;
      found.push_back(full);
      term_ = i;
      key_ = key;
    }
  const std::string what = fmt::format("{} '{}'", of_kernel_ ? "kernel" : "noise",
                                       shortened_spec(of_kernel_ ? system.kernel.spec() : system.noise->spec()));
  if (found.empty())
    throw InputError(fmt::format("{} has no number {}{}", what, quoted_line(name),
                                 valid.empty() ? "" : advice_on_name(name, valid)));
  if (found.size() > 1)
    throw InputError(
        fmt::format("{} has more than one number {}: {}", what, quoted_line(name), fmt::join(found, ", ")));
  if (!of_kernel_) std::swap(terms_[term_], terms_.back());
  if (!of_kernel_) term_ = terms_.size() - 1;
}

StochasticSystem SweptParameter::at(double value) const {
  std::vector<Spec> terms = terms_;
  Spec& term = terms[term_];
  const bool has_amplitude = (key_ == "beta" || key_ == "sigma") && !term.values.contains("friction");
  term.values[key_] = fmt::format("{}", value);
  if (of_kernel_) return {make_kernel(joined(terms), shape_.points), system_.noise};
  if (value == 0 && has_amplitude) terms.pop_back();
  return {system_.kernel, make_noise(terms.empty() ? "none" : joined(terms), shape_)};
}

std::string SweptParameter::pattern() const {
  std::vector<Spec> terms = terms_;
  terms[term_].values[key_] = "…";
  return shortened_spec(joined(terms));
}

std::vector<records::SweepPoint> sample_sweep(const records::EnsembleRun& base, const SweepValues& sweep,
                                              const SavedEnsembles& saved, const std::string& what,
                                              Progress& progress) {
  const SweptParameter parameter(sweep.parameter, base.system, base.shape);
  std::vector<records::SweepPoint> points;
  for (const double value : sweep.values) {
    points.push_back({value, base});
    points.back().run.system = parameter.at(value);
  }
  for (std::size_t i = 0; i < points.size(); ++i)
    saved.sample(points[i].run,
                 fmt::format("{}{} = {:g} ({} of {})", what, sweep.parameter, points[i].value, i + 1, points.size()),
                 progress);
  return points;
}

charts::Series probability_series(const std::vector<records::SweepPoint>& points, const std::string& name) {
  charts::Series series;
  series.name = name;
  for (const records::SweepPoint& point : points) {
    if (point.run.sums.paths.clean == 0) continue;
    const Estimate crossing = point.run.sums.crossing_probability();
    series.x.push_back(point.value);
    series.y.push_back(crossing.value);
    series.error.push_back(2 * crossing.standard_error);
  }
  series.style = charts::SeriesStyle::kPoints;
  return series;
}

}  // namespace pulson
