#pragma once

#include <optional>

#include "rest_model.hpp"

namespace pulson::posterior {

/// The size exponent e of a specimen (see there) at any θ. Thread-safe.
class SizeExponent {
 public:
  /// @param model as of RestModel
  SizeExponent(const Specimen& specimen, const Specimen::Model& model);

  /// 0 without r_B, or where there is no path. Each of two paths is linearised.
  double at(const Specimen::Model& model) const;

 private:
  std::optional<RestModel> at_rest_;  ///< of data at the source, so that the paths fit them
  Eigen::Index coordinates_;
};

}  // namespace pulson::posterior
