// How often does a fast pulson pass through a slow one before it when noise shakes the slow one? From sample paths, a
// function of the seed and their number alone, and without sampling, from the Fokker-Planck equation of the pair.
//
//   $ 04_sample_paths
//   path 0 ends at 21.5 78.5
//   10000 paths: they cross with probability 0.276 +- 0.00447
//   Fokker-Planck: 0.275

#include <iostream>

#include <pulson/pulson.hpp>

int main() {
  const pulson::StochasticSystem system{pulson::make_kernel("gaussian:alpha=1"),
                                        pulson::make_noise("ch-sd:beta=1.5,on=2")};
  const pulson::PhaseState start{.q = pulson::Points{{0.0, 10.0}}, .p = pulson::Points{{4.0, 1.0}}};
  const pulson::TimeGrid grid{.time = 20, .steps = 1000};

  const auto integrator = pulson::make_integrator("variational");
  const pulson::ensemble::SamplePath sample =
      pulson::ensemble::sample_paths(system, *integrator, start, {.grid = grid}).front();
  std::cout.precision(3);
  std::cout << "path 0 ends at " << sample.path.final().q << '\n';

  pulson::ensemble::Ensemble ensemble(system, "variational", start, {.grid = grid, .samples = 10000});
  while (!ensemble.done()) ensemble.advance(100);  // blocks of 64 paths
  const pulson::Estimate crossing = ensemble.sums().crossing_probability();
  std::cout << ensemble.sums().samples << " paths: they cross with probability " << crossing.value << " +- "
            << crossing.standard_error << '\n';

  const pulson::fokker_planck::PairCrossing exact =
      pulson::fokker_planck::crossing_probability({.kernel = system.kernel, .beta = 1.5, .time = 20});
  std::cout << "Fokker-Planck: " << exact.probability << '\n';
}
