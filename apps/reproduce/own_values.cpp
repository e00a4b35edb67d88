#include "own_values.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "ensemble/sweep.hpp"
#include "laboratory.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson {
namespace {

// The amplitude may lack: it is 1 then.
std::string complete(const std::string& noise) { return with_parameter(with_parameter(noise, "beta"), "sigma"); }

}  // namespace

const std::vector<PaperKernel>& paper_kernels() {
  static const std::vector<PaperKernel> kKernels = {{"gaussian:alpha=1", "gaussian", "Gaussian pulsons"},
                                                    {"peakon:alpha=0.5", "peakon", "peakons"}};
  return kKernels;
}

std::vector<PaperKernel> OwnValues::kernels_or(const std::vector<PaperKernel>& of_paper) const {
  return kernel ? std::vector<PaperKernel>{*kernel} : of_paper;
}

bool OwnValues::is_of_paper(const std::vector<double>& betas_of_paper) const {
  return !kernel && noise.empty() && time.value_or(kPaperTime) == kPaperTime &&
         betas_or(betas_of_paper) == betas_of_paper;
}

std::string OwnValues::text() const {
  std::vector<std::string> parts;
  if (!betas.empty()) parts.push_back(fmt::format("β = {}", fmt::join(betas, ", ")));
  if (kernel) parts.push_back("kernel " + kernel->spec);
  if (!noise.empty()) parts.push_back("noise " + noise);
  if (time) parts.push_back(fmt::format("time {}", *time));
  return fmt::format("{}", fmt::join(parts, "; "));
}

PaperKernel own_kernel(const std::string& spec) {
  const std::string full = make_kernel(spec, paper_shape().points).spec();
  for (const PaperKernel& kernel : paper_kernels())
    if (kernel.spec == full) return kernel;
  return {full, full.substr(0, full.find(':')), "pulsons of " + full};
}

std::string amplitude_name(const std::string& noise) {
  std::vector<std::string> found;
  for (const std::string& name : make_noise(complete(noise), paper_shape())->parameter_names())
    if (const std::string last = name.substr(name.rfind('.') + 1); last == "beta" || last == "sigma")
      found.push_back(name);
  if (found.size() == 1) return found.front();
  throw InputError(
      fmt::format("--beta: noise '{}' has {}{}", noise, found.empty() ? "no amplitude" : "more than one amplitude",
                  found.empty() ? "" : fmt::format(": {}; see pulson ensemble --sweep", fmt::join(found, ", "))));
}

std::string noise_at(const std::string& noise, double amplitude) {
  const Landmarks shape = paper_shape();
  const StochasticSystem system{make_kernel(paper_kernels().front().spec, {}), make_noise(complete(noise), shape)};
  return SweptParameter(amplitude_name(noise), system, shape).at(amplitude).noise->spec();
}

}  // namespace pulson
