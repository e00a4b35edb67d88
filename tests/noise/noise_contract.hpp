#pragma once

// The cases of the contract of noise models, and what its tests are given: each row of noise_table(), variants and sums
// of them, and the example of docs/adding_a_noise_model.md, in one, two and three dimensions.

#include <array>
#include <functional>
#include <memory>
#include <ostream>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "noise_definition.hpp"
#include "noise_examples.hpp"
#include "noise_specs.hpp"
#include "pulson/dynamics/stochastic_system.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson {

NoiseTable::Row linear();  // adding_a_noise_model.cpp

struct NoiseCase {
  std::string spec;
  bool grouped = false;
};

inline std::ostream& operator<<(std::ostream& out, const NoiseCase& c) {
  return out << c.spec << (c.grouped ? " of groups" : "");
}

inline std::vector<NoiseCase> cases() {
  std::vector<NoiseCase> all;
  for (const std::string& spec : rows_and_their_sum()) all.push_back({spec});
  for (const std::string fields : {"grid,count=3", "grid,count=2,width=0.8", "bump,center=CENTRES",
                                   "bump,center=CENTRES,width=0.7", "cos", "cos,wavenumber=2.5"})
    all.push_back({"p-sd:beta=0.6,fields=" + fields});
  all.push_back({"ch-sd-screened:beta=0.7,gamma=0.9", true});
  all.push_back({"ch-sd-screened:beta=0.7,gamma=0.9,on=2/3+trouve-vialard:sigma=0.5", true});
  all.push_back({"ch-sd:beta=0.5,on=1+ch-sd:beta=0.8,on=2/3"});
  all.push_back({"langevin:sigma=0.4,friction=0.6+p-sd:beta=0.3,fields=cos+potential:beta=1,gamma=0.5"});
  all.push_back({"none+p-sd:beta=0.3,fields=grid,count=2+p-sd:beta=0.7"});
  all.push_back({"linear:beta=0.7"});
  return all;
}

// Two centres in place of CENTRES.
inline std::string in_dimension(std::string spec, int d) {
  const std::string name = "CENTRES";
  if (const std::size_t at = spec.find(name); at != std::string::npos)
    spec.replace(at, name.size(), std::array{"0.3/-0.4", "0.3/-0.4/0.1/0.5", "0.3/-0.4/0/0.1/0.5/-0.2"}[d - 1]);
  return spec;
}

inline std::shared_ptr<const NoiseModel> make(const std::string& spec, const Landmarks& shape) {
  if (!spec.starts_with("linear")) return make_noise(spec, shape);
  const NoiseTable table("noise", {linear()});
  const auto terms = table.parse(spec);
  return terms.front().first->make(terms.front().second, shape);
}

using Field = std::function<PhaseState(const PhaseState&)>;

// The derivative of `field` along `change` by central differences of order 8.
inline PhaseState differences(const Field& field, const PhaseState& at, const PhaseState& change) {
  constexpr double kStep = 5e-3;
  constexpr std::array<double, 4> kWeights{4.0 / 5, -1.0 / 5, 4.0 / 105, -1.0 / 280};
  PhaseState sum = 0 * at;
  for (int i = 0; i < 4; ++i) {
    const PhaseState shift = (i + 1) * kStep * change;
    sum = sum + kWeights[i] / kStep * (field(at + shift) - field(at - shift));
  }
  return sum;
}

// |A − Aᵀ|/|A| of the matrix A with the columns of `column`.
inline double asymmetry(int d, const std::function<PhaseState(const PhaseState&)>& column) {
  Eigen::MatrixXd a(2 * d * kCount, 2 * d * kCount);
  for (Eigen::Index m = 0; m < a.cols(); ++m) {
    const PhaseState along = column(unit_state(d, m));
    a.col(m) << along.q.reshaped(), along.p.reshaped();
  }
  return a.norm() > 0 ? (a - a.transpose()).norm() / a.norm() : 0;
}

// How far the field X = (q̇, ṗ) is from Hamiltonian: the asymmetry of J·DX, where J(q̇, ṗ) = (ṗ, −q̇).
inline double hamiltonian_defect(const Field& field, const PhaseState& at) {
  return asymmetry(static_cast<int>(at.q.rows()), [&](const PhaseState& change) -> PhaseState {
    const PhaseState x = differences(field, at, change);
    return {x.p, -x.q};
  });
}

// A case in one dimension, with a state and what else its tests need.
struct Subject {
  Subject(const NoiseCase& c, int dimension)
      : d(dimension), spec(in_dimension(c.spec, d)), shape(make_shape(d, c.grouped)) {}

  PhaseState gradient(const PhaseState& at) const { return noise->gradient(at, w); }
  // X = J∇h_w
  PhaseState noise_field(const PhaseState& at) const {
    const PhaseState h = gradient(at);
    return {h.p, -1 * h.q};
  }

  int d;
  std::string spec;
  Landmarks shape;
  std::shared_ptr<const NoiseModel> noise = make(spec, shape);
  DefinedNoise definition{spec, shape};
  NoiseTraits traits = noise->traits();
  int channels = noise->channels(d, kCount);
  PhaseState state = random_state(d, 1);
  PhaseState change = random_state(d, 3);
  Eigen::VectorXd w = random_vector(channels, 5);
};

class NoiseContract : public testing::TestWithParam<NoiseCase> {
 protected:
  template <class Test>
  void in_each_dimension(const Test& test) const {
    for (int d = 1; d <= 3; ++d) {
      SCOPED_TRACE("in " + std::to_string(d) + "D");
      test(Subject(GetParam(), d));
    }
  }
};

}  // namespace pulson
