#include "pulson/noise/noise_table.hpp"

#include "pulson/noise/ch_sd.hpp"

namespace pulson {
namespace {

std::shared_ptr<const NoiseModel> make_none(const Parameters& /*parameters*/) { return std::make_shared<NoNoise>(); }

std::shared_ptr<const NoiseModel> make_ch_sd(const Parameters& parameters) {
  return std::make_shared<ChSd>(parameters.positive("beta"), parameters.indices("on"));
}

}  // namespace

const NameTable<MakeNoise>& noise_table() {
  static const NameTable<MakeNoise> kTable(
      "noise", {{"none", {}, "no noise: the geodesic equations of classical LDDMM", make_none},
                {"ch-sd",
                 {{"beta", "", "amplitude, length per square root of time"},
                  {"on", "all", "landmarks that it acts on, counted from 1, as in 1/3/5"}},
                 "h = beta p_a: noise in the positions; landmarks may pass through each other (paper, section 5.1)",
                 make_ch_sd}});
  return kTable;
}

std::shared_ptr<const NoiseModel> make_noise(std::string_view spec) {
  const auto terms = noise_table().parse(spec);
  if (terms.size() != 1)
    throw InputError("noise '" + std::string(spec) + "': sums of noise models are not supported; give one model");
  return terms.front().first->make(terms.front().second);
}

}  // namespace pulson
