#pragma once

#include <functional>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "pulson/core/errors.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson {

/// What a problem needs is not there: a folder of data, or a mode.
class NotAvailable : public InputError {
 public:
  using InputError::InputError;
};

struct MatchingPair {
  Landmarks source;
  Landmarks target;
};

/// One row of the bank.
struct BankProblem {
  std::string name;
  std::string mode;                       ///< as parse_mode() reads it, which may not know it yet; empty: the default
  matching::RegistrationOptions options;  ///< all but the mode
  std::function<MatchingPair()> shapes;   ///< @throws NotAvailable, InputError
  bool large = false;
  std::optional<double> closed_form{};  ///< what J tends to
};

/// Folders that hold shapes; empty where there is none.
struct BankFolders {
  std::string problems;       ///< NAME_source.csv and NAME_target.csv of P1_20, …
  std::string data;           ///< landmark files of real shapes
  std::string sample_shapes;  ///< of this repository
};

/// All problems. Kernel, λ, σ and steps are given, and nothing is aligned, but for real shapes, which have all
/// defaults.
std::vector<BankProblem> bank_problems(const BankFolders& folders);

}  // namespace pulson
