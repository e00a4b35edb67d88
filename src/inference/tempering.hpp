#pragma once

#include <vector>

#include "chain.hpp"

namespace pulson::inference {

/// Powers τ of the likelihood, increasing to 1; where there are several the first is 0, the others are in geometric
/// progression from 10⁻³.
std::vector<double> first_powers(int count);

/// Powers between which exchanges are rejected equally often, by linear interpolation of the cumulated probabilities of
/// rejection (S. Syed, A. Bouchard-Côté, G. Deligiannidis and A. Doucet, JRSS B 84, 2022, §5).
/// @param rejected mean probabilities, of each pair of neighbours
std::vector<double> retuned(const std::vector<double>& powers, const std::vector<double>& rejected);

/// Chains of all powers which exchange their points after each iteration, of the even pairs of neighbours and of the
/// odd ones in turn; the last is the posterior's.
class Replicas {
 public:
  /// @param number of the group, from 0
  Replicas(const ChainSetting& setting, int number, const std::vector<double>& powers);

  void advance(int warmup);
  void set_powers(const std::vector<double>& powers);
  void write(StateWriter& to) const;
  void read(StateReader& from);

  const Chain& posterior() const { return chains_.back(); }
  const std::vector<Chain>& chains() const { return chains_; }
  /// Mean probabilities of rejection since the powers were set; 0 where no exchange was tried.
  std::vector<double> rejected() const;

 private:
  std::vector<Chain> chains_;
  std::vector<double> rejected_;
  std::vector<int> tried_;
  int iteration_ = 0;
};

}  // namespace pulson::inference
