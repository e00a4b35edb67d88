#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <utility>

#include "pulson/core/landmarks.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/dynamics/noise_model.hpp"

namespace pulson {

/// Makes a model for a shape, of which some take a grid over its box, or its groups.
using MakeNoise = std::shared_ptr<const NoiseModel> (*)(const Parameters&, const Landmarks& shape);
using NoiseTable = NameTable<MakeNoise>;

/// The library's noise models by name; see `pulson info noises` and docs/adding_a_noise_model.md. A table with models
/// of your own is a copy with more rows: NameTable::with().
const NoiseTable& noise_table();

/// The noise model of a specification such as `ch-sd:beta=4,on=2`, or of a sum such as `ch-sd:beta=1+p-sd:beta=0.2`,
/// for landmarks like those of `shape`. @throws InputError
std::shared_ptr<const NoiseModel> make_noise(std::string_view spec, const Landmarks& shape = {},
                                             const NoiseTable& table = noise_table());

/// A noise as options take it: a specification, a specification by a table with models of your own, or a model.
class NoiseChoice {
 public:
  // NOLINTBEGIN(google-explicit-constructor): any of these is a noise
  NoiseChoice(const char* spec) : spec_(spec) {}
  NoiseChoice(std::string spec, std::shared_ptr<const NoiseTable> own = nullptr)
      : spec_(std::move(spec)), own_(std::move(own)) {}
  /// It must fit the shape that it is used for. @throws InputError if there is none
  NoiseChoice(std::shared_ptr<const NoiseModel> model);
  // NOLINTEND(google-explicit-constructor)

  /// As it was given; of a model its own.
  const std::string& spec() const { return spec_; }
  /// That the specification is read by.
  const NoiseTable& table() const { return own_ ? *own_ : noise_table(); }
  /// The model, where the choice is one; else null.
  const std::shared_ptr<const NoiseModel>& model() const { return model_; }
  /// Whether make_noise() of spec() would not do: the choice is a model or has a table of its own.
  bool is_own() const { return model_ || own_; }

  /// The model for landmarks like those of `shape`. @throws InputError as make_noise()
  std::shared_ptr<const NoiseModel> make(const Landmarks& shape) const;

  /// The same kind of choice, of this model: what it became where numbers were fitted.
  NoiseChoice of(std::shared_ptr<const NoiseModel> model) const;

 private:
  std::string spec_;
  std::shared_ptr<const NoiseTable> own_;
  std::shared_ptr<const NoiseModel> model_;
};

}  // namespace pulson
