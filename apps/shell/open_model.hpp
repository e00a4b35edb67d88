#pragma once

#include <string>
#include <vector>

#include "core/open_numbers.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// `--kernel`, `--noise`, `--sigma` and `--lambda`: values, and numbers that are fitted.
class OpenModel {
 public:
  /// @throws InputError where one of them cannot be read, or the noise lacks a number that is not fitted
  OpenModel(const std::string& kernel, const std::string& noise, const std::string& sigma, const std::string& lambda);

  /// What is fitted, as fit_parameters() and make_posterior_problem() name it: of kernel and noise, `data-sigma`,
  /// `lambda`.
  std::vector<std::string> names() const;
  /// The same with their priors: NAME, or NAME=LOGSD.
  std::vector<std::string> priors() const;

  /// Sets them all, the noise without the numbers that have no starting value.
  void set(matching::RegistrationOptions& options) const;
  /// Sets the noise with starting values for what is fitted: matching::with_starting_values().
  void set_noise(const Landmarks& source, const std::vector<Landmarks>& targets,
                 matching::RegistrationOptions& options) const;

 private:
  OpenSpec kernel_, noise_;
  Length sigma_ = 0;
  std::optional<double> lambda_;
  std::vector<OpenNumber> open_;
};

/// What options of a verb say that fits them from no starting value and without a prior: `fit`. @return whether it is
/// so; false: a value @throws InputError that begins with `option`
bool is_fitted(std::string_view option, const std::string& text);

}  // namespace pulson
