#include "pulson/noise/noise_table.hpp"

#include <fmt/core.h>

#include "models.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {

namespace {

void check_no_term_is_empty(std::string_view spec) {
  if (spec.empty()) throw InputError("the noise is empty; no noise is 'none'");
  if (spec.front() == '+' || spec.back() == '+' || spec.find("++") != std::string_view::npos)
    throw InputError("noise " + quoted_line(spec) +
                     ": a term of the sum is empty; models are joined as in ch-sd:beta=1+p-sd:beta=0.2");
}

}  // namespace

const NoiseTable& noise_table() {
  static const NoiseTable rows(
      "noise", {no_noise(), ch_sd(), ch_sd_screened(), p_sd(), kunita(), trouve_vialard(), potential(), langevin()});
  return rows;
}

std::shared_ptr<const NoiseModel> make_noise(std::string_view spec, const Landmarks& shape, const NoiseTable& table) {
  check_no_term_is_empty(spec);
  std::vector<std::shared_ptr<const NoiseModel>> terms;
  const double size = spec.find('%') == std::string_view::npos ? 0 : diameter(shape.points);
  for (const auto& [row, parameters] : table.parse(spec, size)) terms.push_back(row->make(parameters, shape));
  return terms.size() == 1 ? terms.front() : sum_of_noises(std::move(terms));
}

NoiseChoice::NoiseChoice(std::shared_ptr<const NoiseModel> model) : model_(std::move(model)) {
  if (!model_) throw InputError("the noise is no model; no noise is 'none'");
  spec_ = model_->spec();
}

std::shared_ptr<const NoiseModel> NoiseChoice::make(const Landmarks& shape) const {
  return model_ ? model_ : make_noise(spec_, shape, table());
}

NoiseChoice NoiseChoice::of(std::shared_ptr<const NoiseModel> model) const {
  return model_ ? NoiseChoice(std::move(model)) : NoiseChoice(model->spec(), own_);
}

ParameterInfo LandmarkChoice::info() { return {"on", "all", "landmarks that it acts on, counted from 1, as in 1/3/5"}; }

void LandmarkChoice::describe(int dimension, std::vector<NoiseChannel>& channels) const {
  for (int i = 0; i < static_cast<int>(channels.size()); ++i) {
    NoiseChannel& channel = channels[static_cast<std::size_t>(i)];
    channel.landmarks = {(*this)[i / dimension]};
    channel.axis = i % dimension;
  }
}

std::string LandmarkChoice::spec() const {
  std::string text;
  for (const int landmark : on_) text += fmt::format("{}{}", text.empty() ? ",on=" : "/", landmark + 1);
  return text;
}

void LandmarkChoice::check(int landmarks, const std::string& spec) const {
  if (!on_.empty() && on_.back() >= landmarks)
    throw InputError(fmt::format("noise '{}': on={} names a landmark beyond the last; the shape has {}", spec,
                                 on_.back() + 1, landmarks));
}

}  // namespace pulson
