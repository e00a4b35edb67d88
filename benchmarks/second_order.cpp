// Weak errors of compositions of (20) at equal numbers of implicit solves, as Markdown; see docs/orders.md. The pair
// q = (0, 2), p = (2, 1) on a line with the kernel exp(−r²/2), `ch-sd:beta=1` on both and T = 1.

#include <cmath>
#include <cstdio>
#include <exception>
#include <optional>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "pulson/core/parallel.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/random/brownian.hpp"

namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using pulson::PhaseState;
using pulson::Points;
using pulson::TimeGrid;

constexpr double kTime = 1;
constexpr int kBlocks = 64;  // of paths: tasks of the threads, the same for any number of them

struct Options {
  std::vector<int> solves = {8, 16, 32};
  int reference_steps = 256;
  int paths = 200'000;
  std::uint64_t seed = 1;
  int threads = 0;
};

// Increments of the Brownian path on the finest grid, C×(a multiple of the steps).
using Increments = MatrixXd;

// A method takes all steps with a number of implicit solves.
struct Method {
  std::string title;
  PhaseState (*end)(const Increments& finest, int solves);
};

const pulson::StochasticSystem& pair_system(bool noise) {
  const auto make = [](const char* spec) {
    return pulson::StochasticSystem{pulson::make_kernel(fmt::format("gaussian:alpha={:.17g}", std::sqrt(2.0))),
                                    pulson::make_noise(spec)};
  };
  static const pulson::StochasticSystem kNoisy = make("ch-sd:beta=1");
  static const pulson::StochasticSystem kQuiet = make("none");
  return noise ? kNoisy : kQuiet;
}

PhaseState pair_start() { return {Eigen::RowVector2d(0, 2), Eigen::RowVector2d(2, 1)}; }

MatrixXd on_grid(const Increments& finest, int steps) {
  return pulson::coarsened(finest, static_cast<int>(finest.cols()) / steps);
}

PhaseState end_of(const char* integrator, const Increments& finest, int steps) {
  return pulson::make_integrator(integrator)
      ->integrate(pair_system(true), pair_start(), {kTime, steps}, on_grid(finest, steps))
      .final();
}

// (20); the half of the last increment that it leaves to a next step has the mean zero, and is added: less variance.
PhaseState paper_end(const Increments& finest, int solves) {
  PhaseState end = end_of("variational", finest, solves);
  end.q += 0.5 * on_grid(finest, solves).rightCols(1).transpose();
  return end;
}

PhaseState noise_inside_end(const Increments& finest, int solves) {
  return end_of("variational-2", finest, solves / 2);
}

// Half of the noise before each step without noise, and half after it. @param halves 2 a step
PhaseState noise_outside_end(const MatrixXd& halves) {
  const auto flow = pulson::make_integrator("stormer-verlet");
  const auto steps = static_cast<int>(halves.cols()) / 2;
  PhaseState z = pair_start();
  for (int k = 0; k < steps; ++k) {
    z.q += halves.col(2 * k).transpose();
    z = flow->integrate(pair_system(false), z, {kTime / steps, 1}, MatrixXd(0, 1)).final();
    z.q += halves.col(2 * k + 1).transpose();
  }
  return z;
}

PhaseState one_increment_outside_end(const Increments& finest, int solves) {
  const MatrixXd whole = on_grid(finest, solves / 2);
  MatrixXd halves(whole.rows(), solves);
  for (Index k = 0; k < whole.cols(); ++k) halves.middleCols(2 * k, 2).colwise() = 0.5 * whole.col(k);
  return noise_outside_end(halves);
}

PhaseState two_increments_outside_end(const Increments& finest, int solves) {
  return noise_outside_end(on_grid(finest, solves));
}

const std::vector<Method>& methods() {
  static const std::vector<Method> kMethods = {{"(20), `variational`", paper_end},
                                               {"noise in the middle, `variational-2`", noise_inside_end},
                                               {"two halves of one increment outside", one_increment_outside_end},
                                               {"two increments outside", two_increments_outside_end}};
  return kMethods;
}

// q₂ and p₁².
Eigen::Array2d functionals(const PhaseState& z) { return {z.q(1), z.p(0) * z.p(0)}; }

// Sums over paths of the errors and of their squares, 2 functionals × (method, number of solves).
struct Sums {
  Eigen::Array2Xd error;
  Eigen::Array2Xd square;
  int paths = 0;
  int lost = 0;  // a step had no solution in some method
};

// Errors of one path, none where a step has no solution.
std::optional<Eigen::Array2Xd> errors_of(const Options& options, std::uint64_t path) {
  const Increments finest =
      pulson::brownian_increments(options.seed, path, 2, TimeGrid{kTime, options.reference_steps});
  Eigen::Array2Xd errors(2, static_cast<Index>(methods().size() * options.solves.size()));
  try {
    const Eigen::Array2d exact = functionals(end_of("heun", finest, options.reference_steps));
    Index column = 0;
    for (const int solves : options.solves)
      for (const Method& method : methods()) errors.col(column++) = functionals(method.end(finest, solves)) - exact;
  } catch (const pulson::StepError&) {
    return std::nullopt;
  }
  return errors;
}

Sums measure(const Options& options) {
  std::vector<Sums> blocks(kBlocks);
  const auto columns = static_cast<Index>(methods().size() * options.solves.size());
  pulson::parallel_for(kBlocks, [&](int b) {
    Sums sums{Eigen::Array2Xd::Zero(2, columns), Eigen::Array2Xd::Zero(2, columns)};
    for (int path = b; path < options.paths; path += kBlocks) {
      const std::optional<Eigen::Array2Xd> errors = errors_of(options, static_cast<std::uint64_t>(path));
      if (!errors) {
        ++sums.lost;
        continue;
      }
      sums.error += *errors;
      sums.square += errors->square();
      ++sums.paths;
    }
    blocks[static_cast<std::size_t>(b)] = std::move(sums);
  });
  Sums all = blocks.front();
  for (std::size_t b = 1; b < blocks.size(); ++b) {
    all.error += blocks[b].error;
    all.square += blocks[b].square;
    all.paths += blocks[b].paths;
    all.lost += blocks[b].lost;
  }
  return all;
}

void print(const Sums& sums, const Options& options) {
  fmt::print(
      "{} paths, seed {}, {} left out, reference of {} steps; errors of E q₂ and E p₁² with standard errors.\n\n",
      sums.paths, options.seed, sums.lost, options.reference_steps);
  fmt::print("| solves |");
  for (const Method& method : methods()) fmt::print(" {} |", method.title);
  fmt::print("\n|---|---|---|---|---|\n");
  const Eigen::Array2Xd mean = sums.error / sums.paths;
  const Eigen::Array2Xd deviation = ((sums.square / sums.paths - mean.square()) / sums.paths).sqrt();
  Index column = 0;
  for (const int solves : options.solves) {
    fmt::print("| {} |", solves);
    for (std::size_t m = 0; m < methods().size(); ++m, ++column)
      fmt::print(" {:.1e} ± {:.0e}, {:.1e} ± {:.0e} |", mean(0, column), deviation(0, column), mean(1, column),
                 deviation(1, column));
    fmt::print("\n");
  }
}

int run(int argc, char** argv) {
  CLI::App program("Weak errors of compositions of (20) at equal numbers of implicit solves, as Markdown");
  Options options;
  program.add_option("--paths", options.paths, "Brownian paths")->capture_default_str()->check(CLI::Range(2, 1 << 30));
  program.add_option("--seed", options.seed, "of the paths")->capture_default_str();
  program.add_option("--threads", options.threads, "0: one per core; results do not depend on it")
      ->capture_default_str();
  program.add_option("--solves", options.solves, "implicit solves of a path, even divisors of --reference")
      ->delimiter(',');
  program.add_option("--reference", options.reference_steps, "steps of the reference")->capture_default_str();
  CLI11_PARSE(program, argc, argv);
  for (const int solves : options.solves)
    if (solves < 2 || solves % 2 != 0 || options.reference_steps % solves != 0)
      throw pulson::InputError(fmt::format("{} solves are no even divisor of {}", solves, options.reference_steps));
  pulson::set_thread_count(options.threads);
  print(measure(options), options);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fputs((std::string(error.what()) + "\n").c_str(), stderr);
    return 2;
  }
}
