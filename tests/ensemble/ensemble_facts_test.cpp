// Pair lanes path by path, how paths are lost, and Monte Carlo numbers that a separate implementation of (20) gave,
// with tolerances of five standard errors of both.

#include <cmath>

#include "ensemble_examples.hpp"

namespace pulson::ensemble {
namespace {

constexpr double kErrors = 5;

struct LaneCase {
  std::string kernel;
  std::string noise;
  std::string integrator;
};

const std::vector<LaneCase> kLaneCases = {
    {"gaussian:alpha=1", "potential:beta=0.5,gamma=2", "variational"},
    {"peakon:alpha=0.5", "potential:beta=0.5,gamma=4", "variational-paper"},
    {"gaussian:alpha=1", "ch-sd-screened:beta=0.7,gamma=4,on=1", "variational-paper"},
    {"gaussian:alpha=1", "ch-sd-screened:beta=0.7,gamma=4,on=2", "variational-paper"},
    {"matern52:alpha=1", "ch-sd-screened:beta=0.7,gamma=4", "variational-paper"},
    {"peakon:alpha=0.5", "ch-sd-screened:beta=0.7,gamma=2", "variational-paper"},
    {"gaussian:alpha=1", "ch-sd:beta=1.5,on=1", "variational-paper"},
    {"gaussian:alpha=1,weight=2", "ch-sd:beta=1", "variational"},
    {"matern32:alpha=1", "p-sd:beta=1", "variational"},
    {"gaussian:alpha=1", "trouve-vialard:sigma=0.3,common=1", "variational"},
    {"gaussian:alpha=1", "trouve-vialard:sigma=0.3,on=2", "variational-paper"},
    {"peakon:alpha=0.5", "ch-sd:beta=1+trouve-vialard:sigma=0.1,on=1", "variational"},
    {"gaussian:alpha=1", "ch-sd:beta=1+trouve-vialard:sigma=0.1", "variational"},
    {"gaussian:alpha=1", "none", "variational"}};

// Where momenta have grown large the gap is tiny, and the integrator, which keeps q₁ and q₂, has lost digits of it.
TEST(PairLanesOfAnEnsemble, AreThePathsOfTheIntegrator) {
  int compared = 0;
  for (const auto& [kernel, noise, integrator] : kLaneCases) {
    for (const PhaseState& start : {pair_at(0, 3, 4, 1), pair_at(3, 0, 1, 4), pair_at(-1, 1, 2, -1)}) {
      SCOPED_TRACE(kernel + " " + noise + " " + integrator + " from " + std::to_string(start.q(0)));
      EnsembleExample example{.kernel = kernel, .noise = noise, .integrator = integrator, .start = start};
      example.options = options_of({5, 250}, 40, 21);
      example.options.records = {0, 1, 2, 20, 77, 250};
      example.options.keep = KeepStates::kAll;
      ASSERT_EQ(example.ensemble().method(), "pair lanes");
      const std::vector<double> found = example.sums().states;
      const auto paths = sample_paths(example.system(), *make_integrator(integrator), start,
                                      {.grid = example.options.grid, .seed = 21, .samples = 40});
      for (std::size_t m = 0; m < paths.size(); ++m) {
        double largest = 0;
        for (std::size_t step = 0, record = 0; record < 6; ++step) {
          const auto& states = paths[m].path.states;
          const bool gone = step >= states.size();
          if (!gone) largest = std::max(largest, states[step].p.cwiseAbs().maxCoeff());
          if (largest > 100) break;
          if (static_cast<int>(step) != example.options.records[record]) continue;
          const Eigen::Map<const Eigen::Array4d> lane(&found[(m * 6 + record++) * 4]);
          if (gone) {
            EXPECT_TRUE(lane.isNaN().all()) << m << ", " << step;
            continue;
          }
          Eigen::Array4d expected;
          expected << states[step].q(0), states[step].q(1), states[step].p(0), states[step].p(1);
          EXPECT_LT((lane - expected).abs().maxCoeff(), 1e-9 * std::max(1.0, largest)) << m << ", " << step;
          ++compared;
        }
      }
    }
  }
  EXPECT_GT(compared, 14 * 3 * 40 * 4);
}

// A head-on encounter, by the same scheme with 64-bit mantissas and the gap in place of q₂.
TEST(PairLanesOfAnEnsemble, KeepTinyGapsExact) {
  EnsembleExample example{.noise = "none", .start = pair_at(-1, 1, 2, -1)};
  example.options = options_of({5, 250}, 1);
  example.options.keep = KeepStates::kFinal;
  const EnsembleSums sums = example.sums();
  const long double dt = 5.0L / 250;
  long double q1 = -1;
  long double gap = 2;
  long double p1 = 2;
  long double p2 = -1;
  for (int step = 0; step < 250; ++step) {
    const long double c = gap;
    const long double a = dt * (p2 - p1);
    long double low = 0;
    long double high = c;
    for (int turn = 0; turn < 200; ++turn) {
      gap = (low + high) / 2;
      (gap + a * std::expm1(-gap * gap) > c ? high : low) = gap;
    }
    const long double k = std::exp(-gap * gap);
    const long double force = -2 * dt * gap * k * p1 * p2;
    q1 += dt * (p1 + k * p2);
    p1 += force;
    p2 -= force;
  }
  ASSERT_GT(p1, 1e5);
  EXPECT_NEAR(sums.states[0], static_cast<double>(q1), 1e-12 * static_cast<double>(q1));
  EXPECT_NEAR(sums.states[2], static_cast<double>(p1), 1e-11 * static_cast<double>(p1));
  EXPECT_NEAR(sums.states[3], static_cast<double>(p2), 1e-11 * static_cast<double>(p1));
}

TEST(PairLanesOfAnEnsemble, LeaveTheCompensatedScreenedNoiseToTheIntegrator) {
  const EnsembleExample example{.noise = "ch-sd-screened:beta=1,gamma=4", .options = options_of({1, 10}, 1)};
  EXPECT_NE(example.ensemble().method(), "pair lanes");
}

/// The paper's pair until T = 100.
EnsembleExample paper_example(const std::string& kernel, double p1, const std::string& noise, std::int64_t samples) {
  return {.kernel = kernel,
          .noise = noise,
          .start = pair_at(0, 10, p1, 1),
          .options = options_of({100, 5000}, samples, 2024)};
}

struct Crossing {
  std::string kernel;
  double p1;
  double beta;
  double probability;  // of 50,048 samples
};

TEST(EnsembleFacts, CrossingProbabilitiesAreTheReferences) {
  for (const auto& [kernel, p1, beta, probability] : std::vector<Crossing>{{"gaussian:alpha=1", 4, 2, 0.402633},
                                                                           {"gaussian:alpha=1", 8, 6.5, 0.857976},
                                                                           {"gaussian:alpha=1", 1, 1, 0.026515},
                                                                           {"peakon:alpha=0.5", 2, 4, 0.702985},
                                                                           {"peakon:alpha=0.5", 4, 0.5, 0.046675}}) {
    SCOPED_TRACE(kernel + ", p1 = " + std::to_string(p1) + ", beta = " + std::to_string(beta));
    constexpr std::int64_t kSamples = 6400;
    const EnsembleSums sums = paper_example(kernel, p1, "ch-sd:on=2,beta=" + std::to_string(beta), kSamples).sums();
    EXPECT_EQ(sums.paths.clean, kSamples);
    const Estimate found = sums.crossing_probability();
    const double deviation = std::sqrt(probability * (1 - probability));
    EXPECT_NEAR(found.value, probability, kErrors * deviation * std::sqrt(1 / 6400.0 + 1 / 50048.0));
    EXPECT_NEAR(found.standard_error, deviation / 80, 0.15 * deviation / 80);
    EXPECT_GT(sums.crossing.ever, sums.crossing.at_end);
    EXPECT_LT(sums.momentum_error, 1e-11);
  }
}

TEST(EnsembleFacts, MeanPathsAreTheReferences) {
  struct Mean {
    double beta;
    std::array<double, 6> values;  // q1, q2, p1 at t = 10, and at t = 100
  };
  // Of 20,000 samples: p1 ± 0.011, q ± 0.1 at t = 10 and ± 1 at t = 100.
  constexpr std::array<double, 6> kReferenceErrors = {0.1, 0.1, 0.011, 1, 1, 0.011};
  constexpr std::array<Eigen::Index, 3> kCoordinates = {0, 1, 2};
  for (const Mean& mean :
       {Mean{1.5, {27.4, 35.7, 1.861, 193.9, 319.1, 1.848}}, Mean{4.5, {36.9, 25.8, 3.364, 335.5, 177.9, 3.309}}}) {
    SCOPED_TRACE(mean.beta);
    EnsembleExample example =
        paper_example("gaussian:alpha=1", 4, "ch-sd:on=2,beta=" + std::to_string(mean.beta), 6400);
    example.options.records = {500, 5000};
    const EnsembleSums sums = example.sums();
    for (std::size_t i = 0; i < 6; ++i) {
      const double own = sums.mean_error(i / 3)[kCoordinates.at(i % 3)];
      EXPECT_NEAR(sums.moments[i / 3].mean[kCoordinates.at(i % 3)], mean.values.at(i),
                  kErrors * std::hypot(own, kReferenceErrors.at(i)))
          << i;
      // The samples of both have one variance.
      EXPECT_NEAR(own * std::sqrt(6400.0 / 20000), kReferenceErrors.at(i), 0.6 * kReferenceErrors.at(i)) << i;
    }
  }
}

TEST(EnsembleFacts, AntitheticPathsHaveTheSameProbability) {
  EnsembleExample example = paper_example("gaussian:alpha=1", 4, "ch-sd:on=2,beta=2", 6400);
  example.options.antithetic = true;
  const Estimate found = example.sums().crossing_probability();
  EXPECT_NEAR(found.value, 0.402633, kErrors * std::hypot(found.standard_error, 0.002192));
  EXPECT_GT(found.standard_error, 0);
  EXPECT_LT(found.standard_error, 0.00613 * 1.05) << "opposite noise does not make it larger than that of free paths";
}

// (20) as printed gives 0.297; the Stratonovich equation 0.34.
TEST(EnsembleFacts, ScreenedNoiseByThePapersSchemeIsTheReferences) {
  EnsembleExample example = paper_example("gaussian:alpha=1", 4, "ch-sd-screened:beta=4,gamma=4,on=2", 12800);
  example.integrator = "variational-paper";
  const EnsembleSums sums = example.sums();
  const Estimate found = sums.crossing_probability();
  EXPECT_NEAR(found.value, 0.297, kErrors * std::hypot(found.standard_error, 0.005));
  // About 0.5 % have a step without a root.
  const std::int64_t lost = sums.paths.no_root + sums.paths.momentum_bound;
  EXPECT_GT(sums.paths.no_root, 0);
  EXPECT_LT(static_cast<double>(lost) / 12800, 0.03);
  EXPECT_EQ(sums.paths.clean + lost, 12800);
  EXPECT_GT(sums.largest_momentum, 1e4);
}

TEST(EnsembleFacts, ConstantFieldsCauseNoCrossing) {
  for (const double beta : {1.0, 6.5}) {
    const EnsembleSums sums = paper_example("gaussian:alpha=1", 4, "p-sd:beta=" + std::to_string(beta), 1280).sums();
    EXPECT_EQ(sums.paths.clean, 1280);
    EXPECT_EQ(sums.crossing.ever, 0);
  }
}

// Head-on encounters of gaussian pulsons, of which noise in the momenta makes many, let |p| grow exponentially.
TEST(EnsembleFacts, NoiseInTheMomentaDrivesThemBeyondTheBound) {
  EnsembleExample example{.noise = "trouve-vialard:sigma=8", .options = options_of({20, 1000}, 640)};
  const EnsembleSums sums = example.sums();
  EXPECT_GT(sums.paths.momentum_bound, 32);
  EXPECT_GT(sums.paths.clean, 32);
  EXPECT_GT(sums.largest_momentum, 1e8);
  EXPECT_EQ(sums.paths.total(), 640);
  EXPECT_EQ(sums.moments.back().count, sums.paths.clean);
  EXPECT_EQ(sums.crossing.at_end, 0);
  example.options.momentum_bound = 1e4;
  EXPECT_GE(example.sums().paths.momentum_bound, sums.paths.momentum_bound);
}

// No number of the statistics may be other than finite, whatever the bound lets through.
TEST(EnsembleFacts, NoBoundLetsNumbersThatAreNotFinitePass) {
  for (const double bound : {1e8, 1e100, 1e300, std::numeric_limits<double>::infinity()}) {
    for (const std::string noise : {"trouve-vialard:sigma=20", "potential:beta=30,gamma=1"}) {
      SCOPED_TRACE(noise + ", bound " + std::to_string(bound));
      EnsembleExample example{.noise = noise, .options = options_of({30, 1500}, 192)};
      example.options.momentum_bound = bound;
      example.options.records = {0, 499, 500, 501, 502, 503, 504, 1500};
      const EnsembleSums sums = example.sums();
      EXPECT_EQ(sums.paths.total(), 192);
      EXPECT_EQ(sums.paths.clean, sums.moments.back().count);
      for (const Moments& moments : sums.moments) EXPECT_TRUE(moments.count == 0 || moments.mean.isFinite().all());
    }
  }
}

// Landmarks at one place stay there: a tie, and neither clean nor crossed.
TEST(EnsembleFacts, LandmarksAtOnePlaceAreTies) {
  for (const bool antithetic : {false, true}) {
    EnsembleExample example{.noise = "p-sd:beta=1", .start = pair_at(2, 2, 3, 1)};
    example.options = options_of({1, 50}, 70);
    example.options.antithetic = antithetic;
    const EnsembleSums sums = example.sums();
    EXPECT_EQ(sums.paths.tie, 70);
    EXPECT_EQ(sums.paths.clean, 0);
    EXPECT_EQ(sums.crossing.ever, 0);
    EXPECT_EQ(sums.crossing.pairs, (std::array<std::int64_t, 3>{})) << "pairs of clean paths";
  }
}

}  // namespace
}  // namespace pulson::ensemble
