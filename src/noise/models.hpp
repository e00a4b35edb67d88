#pragma once

#include <string>
#include <vector>

#include "pulson/core/name_table.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson {

// The rows of noise_table(), one function for each file of this folder.
NoiseTable::Row no_noise();
NoiseTable::Row ch_sd();
NoiseTable::Row ch_sd_screened();
NoiseTable::Row p_sd();
NoiseTable::Row trouve_vialard();
NoiseTable::Row potential();
NoiseTable::Row kunita();
NoiseTable::Row langevin();

/// The channels of all terms one after the other, and everything else their sum. @param terms at least two
std::shared_ptr<const NoiseModel> sum_of_noises(std::vector<std::shared_ptr<const NoiseModel>> terms);

/// The landmarks that a noise model acts on: all, or those that `on=` names.
class LandmarkChoice {
 public:
  /// What the table says of `on`.
  static ParameterInfo info();

  LandmarkChoice() = default;
  /// From `on=1/3/5`.
  explicit LandmarkChoice(const Parameters& parameters) : on_(parameters.indices("on")) {}

  int count(int landmarks) const { return on_.empty() ? landmarks : static_cast<int>(on_.size()); }
  /// Those that are named, from 0; none where all are meant.
  const std::vector<int>& listed() const { return on_; }
  /// The index of the i-th chosen landmark, from 0.
  int operator[](int i) const { return on_.empty() ? i : on_[static_cast<std::size_t>(i)]; }

  /// The channels are one for each chosen landmark and axis, axis fastest.
  void describe(int dimension, std::vector<NoiseChannel>& channels) const;

  /// `,on=1/3/5`, or nothing for all.
  std::string spec() const;

  /// @throws InputError if a chosen landmark is beyond the last; `spec` names the model
  void check(int landmarks, const std::string& spec) const;

 private:
  std::vector<int> on_;
};

}  // namespace pulson
