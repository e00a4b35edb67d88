// How often the searches of `register` miss the least minimum, as a table in Markdown; see docs/benchmarks.md.
//
//   minima [--landmarks 4,5,6,8] [--beta 0,0.03,0.1,0.3] [--dimension 2] [--count 100] [--steps 20] [--seed 1]
//
// Random pairs of landmarks, uniform in ±1.2; on a line permutations of points with gaps uniform in 0.6 to 1.4. The
// kernel is gaussian:alpha=1, λ = 1, σ = 0.01. Beside search_paths() and search_globally() stands the best of them and
// of many other searches: down several sequences of β from straight paths and from bent ones. Whatever one finds is
// searched again in all steps, by the same code, before costs are compared.

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <exception>
#include <limits>
#include <memory>
#include <numbers>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "global_search.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/data_term.hpp"
#include "pulson/noise/noise_table.hpp"

namespace {

using namespace pulson;
using namespace pulson::matching;
using Eigen::Index;

constexpr double kSigma = 0.01;
constexpr double kLambda = 1;
constexpr double kHalfSide = 1.2;       // of the square that landmarks are drawn in
constexpr double kMissed = 0.01;        // of the least J: above it by more is a miss
constexpr int kFewSteps = 8;            // of other searches but on a line, before all
constexpr double kFarAbove = 0.1;       // of J: a branch that costs more is left
constexpr double kSameMinimum = 1e-3;   // of J in few steps: searched for in all steps once
constexpr double kLastBeta = 0.02;      // before 0
constexpr int kMostIterations = 100;    // of other searches, for each β
constexpr double kBranchTolerance = 1;  // relative gradient at which a branch goes on
constexpr double kMinimumTolerance = 0.01;

struct Options {
  std::vector<int> landmarks{4, 5, 6, 8};
  std::vector<double> betas{0, 0.03, 0.1, 0.3};
  int dimension = 2;
  double alpha = 1;
  int count = 100;
  int steps = 20;
  int bends = 48;
  std::uint64_t seed = 1;
  bool list = false;
};

struct Pair {
  Points source, target;
};

Points points_in_a_box(const Options& options, int count, std::mt19937_64& engine) {
  std::uniform_real_distribution<double> uniform(-kHalfSide, kHalfSide);
  Points points(options.dimension, count);
  for (double& x : points.reshaped()) x = std::round(100 * uniform(engine)) / 100;
  return points;
}

Points points_on_a_line(int count, std::mt19937_64& engine) {
  std::uniform_real_distribution<double> gap(0.6, 1.4);
  Points points(1, count);
  double end = 0;
  for (double& x : points.reshaped()) x = end += std::round(100 * gap(engine)) / 100;
  return points;
}

Pair random_pair(const Options& options, int count, std::mt19937_64& engine) {
  if (options.dimension > 1) {
    Points source = points_in_a_box(options, count, engine);
    return {std::move(source), points_in_a_box(options, count, engine)};
  }
  Pair pair{points_on_a_line(count, engine), points_on_a_line(count, engine)};
  std::shuffle(pair.target.data(), pair.target.data() + count, engine);
  return pair;
}

MatchingProblem problem_of(const Pair& pair, double beta, const Options& options) {
  const auto noise = make_noise(beta > 0 ? fmt::format("ch-sd:beta={:.17g}", beta) : "none");
  const auto kernel = make_kernel(fmt::format("gaussian:alpha={:.17g}", options.alpha), pair.source);
  const auto data = std::make_shared<LandmarkTerm>(LandmarkObservations{pair.target, kSigma});
  return {{kernel, noise}, nullptr, {1, options.steps}, pair.source, data, kSigma, kLambda};
}

// β from `first` down to `last`.
std::vector<double> falling(double first, double ratio, double last) {
  std::vector<double> betas;
  for (double beta = first; beta > std::max(last, kLastBeta); beta *= ratio) betas.push_back(beta);
  betas.push_back(last);
  return betas;
}

// The best of many searches, and of the paths that others offer.
class Oracle {
 public:
  Oracle(const Pair& pair, double beta, const Options& options, std::uint64_t seed)
      : pair_(pair), beta_(beta), options_(options), few_(options), engine_(seed), way_(pair.target - pair.source) {
    if (options.dimension > 1) few_.steps = std::min(options.steps, kFewSteps);
  }

  double best() const { return best_; }

  // Its cost once it is searched again in all steps.
  double offer(const std::vector<Points>& nodes) {
    const std::optional<PathSolution> solution =
        search(resampled(nodes, options_.steps), problem_of(pair_, beta_, options_), {});
    if (!solution || !solution->converged) return std::numeric_limits<double>::infinity();
    best_ = std::min(best_, solution->cost.total());
    return solution->cost.total();
  }

  void look() {
    const Points none = Points::Zero(way_.rows(), way_.cols());
    const double half = 0.5, root = std::sqrt(half);
    for (const auto& [first, ratio] : {std::pair{1.0, half}, {2.0, root}, {1.0, 0.3}, {4.0, 0.84}, {0.5, half}})
      follow(none, first, ratio);
    constexpr std::array kAmplitudes{0.4, 0.8, 1.2, 0.2};
    for (const double first : {0.25, 0.12})
      for (const double amplitude : kAmplitudes)
        for (const double side : {amplitude, -amplitude}) follow(to_sides([&] { return side; }), first, 0.4);
    for (int i = 0; i < options_.bends; ++i) {
      const double amplitude = kAmplitudes[static_cast<std::size_t>(i) % kAmplitudes.size()];
      const bool is_bump = i % 5 == 4;
      const Points bend =
          is_bump ? bump(amplitude) : to_sides([&] { return engine_() % 2 == 0 ? amplitude : -amplitude; });
      follow(bend, i % 3 == 0 ? 0.12 : 0.25, 0.4);
    }
  }

 private:
  static std::optional<PathSolution> search(std::vector<Points> nodes, const MatchingProblem& problem,
                                            const MinimiseOptions& how) {
    auto path = along({problem.system, problem.lambda}, problem.grid, std::move(nodes));
    if (!path) return std::nullopt;
    return continue_path(problem, how, std::move(*path), Finish::kNoSaddle);
  }

  Points bump(double amplitude) {
    std::normal_distribution<double> normal;
    return Points::NullaryExpr(way_.rows(), way_.cols(), [&](Index, Index) { return amplitude * normal(engine_); });
  }

  // Each landmark to a side of its way, by what `part` of its length draws; in space about an axis of its own, on a
  // line ahead or back.
  template <class Part>
  Points to_sides(const Part& part) {
    Points bend(way_.rows(), way_.cols());
    for (Index a = 0; a < way_.cols(); ++a) {
      const double by = part();
      const auto step = way_.col(a);
      if (way_.rows() == 1) {
        bend(0, a) = by * step[0];
      } else if (way_.rows() == 2) {
        bend.col(a) << -by * step[1], by * step[0];
      } else {
        const Points direction = bump(1);
        const Eigen::VectorXd across = direction.col(a) - direction.col(a).dot(step) / step.squaredNorm() * step;
        bend.col(a) = by * step.norm() * across.normalized();
      }
    }
    return bend;
  }

  bool is_known(double cost) const {
    return std::any_of(known_.begin(), known_.end(),
                       [&](double other) { return std::abs(cost - other) <= kSameMinimum * cost; });
  }

  // The branch of β from the path that is bent half way.
  void follow(const Points& bend, double first, double ratio) {
    std::vector<Points> nodes;
    for (int k = 0; k <= few_.steps; ++k) {
      const double t = static_cast<double>(k) / few_.steps;
      nodes.emplace_back(pair_.source + t * way_ + std::sin(std::numbers::pi * t) * bend);
    }
    MinimiseOptions how;
    how.max_iterations = kMostIterations;
    double cost = 0;
    for (const double beta : falling(std::max(first, beta_), ratio, beta_)) {
      how.gradient_tolerance = beta > beta_ ? kBranchTolerance : kMinimumTolerance;
      std::optional<PathSolution> solution = search(std::move(nodes), problem_of(pair_, beta, few_), how);
      if (!solution || solution->cost.total() > (1 + kFarAbove) * best_) return;
      nodes = std::move(solution->path.nodes);
      cost = solution->cost.total();
    }
    if (!is_known(cost)) offer(nodes);
    known_.push_back(cost);
  }

  const Pair& pair_;
  double beta_;
  const Options& options_;
  Options few_;
  std::mt19937_64 engine_;
  Points way_;
  double best_ = std::numeric_limits<double>::infinity();
  std::vector<double> known_;  // J of minima in few steps
};

double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

struct Tally {
  int missed = 0;
  double worst = 1;  ///< J over the least
  double seconds = 0;

  bool add(double cost, double best) {
    worst = std::max(worst, cost / best);
    const bool is_missed = cost > (1 + kMissed) * best;
    missed += is_missed ? 1 : 0;
    return is_missed;
  }
};

struct Row {
  Tally one, several;
  int two_searches = 0, two_wrong = 0, unconverged = 0;
};

template <class Search>
PathSolution timed(Tally& tally, const Search& search) {
  const double start = cpu_seconds();
  PathSolution found = search();
  tally.seconds += cpu_seconds() - start;
  return found;
}

void add(Row& row, const Pair& pair, double beta, const Options& options, std::uint64_t seed) {
  const MatchingProblem problem = problem_of(pair, beta, options);
  const PathSolution one = timed(row.one, [&] { return search_paths(problem, {}, nullptr, Finish::kNoSaddle); });
  const PathSolution several = timed(row.several, [&] { return search_globally(problem, {}, Finish::kNoSaddle); });
  Oracle oracle(pair, beta, options, seed);
  const double cost_of_one = oracle.offer(one.path.nodes);
  const double cost_of_several = oracle.offer(several.path.nodes);
  oracle.look();
  row.one.add(cost_of_one, oracle.best());
  const bool is_missed = row.several.add(cost_of_several, oracle.best());
  if (!several.converged) ++row.unconverged;
  int searches = 0;
  for (const Minimum& minimum : several.minima) searches += minimum.found;
  if (searches == 2) {
    ++row.two_searches;
    if (is_missed) ++row.two_wrong;
  }
  if (options.list)
    fmt::print(stderr, "{} {} {} {:.6g} {:.6g} {:.6g} {}\n", pair.source.cols(), beta, seed, cost_of_one,
               cost_of_several, oracle.best(), searches);
}

void print(const Row& row, int landmarks, double beta, int count) {
  fmt::print("| {} | {} | {} | {}, {:.2f} | {}, {:.2f} | {} | {}, {} | {:.4f} | {:.4f} |\n", landmarks, beta, count,
             row.one.missed, row.one.worst, row.several.missed, row.several.worst, row.unconverged, row.two_searches,
             row.two_wrong, row.one.seconds / count, row.several.seconds / count);
  std::fflush(stdout);
}

void study(const Options& options) {
  fmt::print(
      "| N | β | problems | one search: missed, worst | several: missed, worst | unconverged | two sufficed, wrongly | "
      "CPU s, one | several |\n|---|---|---|---|---|---|---|---|---|\n");
  for (const int landmarks : options.landmarks)
    for (const double beta : options.betas) {
      std::mt19937_64 engine(options.seed);
      Row row;
      for (int i = 0; i < options.count; ++i)
        add(row, random_pair(options, landmarks, engine), beta, options, static_cast<std::uint64_t>(i));
      print(row, landmarks, beta, options.count);
    }
}

int run(int argc, char** argv) {
  CLI::App program("Searches that miss the least minimum, of random pairs of landmarks");
  Options options;
  program.add_option("--landmarks", options.landmarks)->delimiter(',');
  program.add_option("--beta", options.betas, "of ch-sd; 0: geodesics")->delimiter(',');
  program.add_option("--dimension", options.dimension)->check(CLI::Range(1, 3));
  program.add_option("--alpha", options.alpha, "width of the kernel");
  program.add_option("--count", options.count, "problems of each row")->check(CLI::PositiveNumber);
  program.add_option("--steps", options.steps)->check(CLI::PositiveNumber);
  program.add_option("--bends", options.bends, "random ones, of the searches to compare with");
  program.add_option("--seed", options.seed);
  program.add_flag("--list", options.list, "J of each problem on standard error");
  CLI11_PARSE(program, argc, argv);
  const SerialBlas serial;
  set_thread_count(1);
  study(options);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "minima: {}\n", error.what());
    return 1;
  }
}
