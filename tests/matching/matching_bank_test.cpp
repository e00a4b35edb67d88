#include <cmath>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "accurate_shot.hpp"
#include "matching_problems.hpp"

namespace pulson::matching {
namespace {

const std::string kRoot = PULSON_SOURCE_DIR;

std::vector<BankProblem> own_problems() {
  return bank_problems({.problems = "", .data = "", .sample_shapes = kRoot + "/sample_shapes"});
}

BankProblem problem_of(const std::string& name) {
  for (const BankProblem& problem : own_problems())
    if (problem.name == name) return problem;
  throw InputError(name);
}

Registration solved(const std::string& name, const std::string& mode, const std::string& integrator) {
  const BankProblem problem = problem_of(name);
  RegistrationOptions options = problem.options;
  options.mode = parse_mode(mode);
  options.integrator = integrator;
  const MatchingPair shapes = problem.shapes();
  return register_shapes(shapes.source, shapes.target, options);
}

TEST(MatchingBank, NamesAreDistinctAndShapesCorrespond) {
  std::set<std::string> names;
  int own = 0;
  for (const BankProblem& problem : own_problems()) {
    EXPECT_TRUE(names.insert(problem.name).second) << problem.name;
    try {
      const MatchingPair shapes = problem.shapes();
      EXPECT_EQ(shapes.source.points.cols(), shapes.target.points.cols()) << problem.name;
      EXPECT_EQ(shapes.source.points.rows(), shapes.target.points.rows()) << problem.name;
      EXPECT_TRUE(shapes.target.points.allFinite()) << problem.name;
      ++own;
    } catch (const NotAvailable& error) {
      EXPECT_THAT(error.what(), testing::StartsWith("needs --")) << problem.name;
    }
  }
  EXPECT_GE(own, 40);
}

TEST(MatchingBank, TheLowestCostsAreOfItsProblems) {
  std::set<std::string> names;
  for (const BankProblem& problem : own_problems()) names.insert(problem.name);
  std::ifstream file(kRoot + "/benchmarks/matching_bank.txt");
  for (std::string line; std::getline(file, line);) {
    const bool comment = line.starts_with('#');
    EXPECT_TRUE(comment || names.contains(line.substr(0, line.find(' ')))) << line;
  }
}

TEST(MatchingBank, SwapsHaveTheirClosedForm) {
  EXPECT_NEAR(swap_closed_form(1, 0.5), 2.2539, 5e-5);
  EXPECT_NEAR(swap_closed_form(1, 1), 0.8132, 5e-5);
  EXPECT_NEAR(swap_closed_form(1, 2), 0.2355, 5e-5);
  EXPECT_NEAR(swap_closed_form(10, 1), 0.9756, 5e-5);
}

// The kernel, its forces and the energy of the check are its own; rk4's agree to their order, variational's to theirs.
TEST(AccurateShot, AgreesWithAnAccurateIntegratorAndShowsACoarseOne) {
  const Registration accurate = solved("square_90", "deterministic", "rk4");
  const AccurateShot check = shoot_accurately(accurate);
  EXPECT_LT(check.end_error, 1e-6);
  EXPECT_LT(check.step_error, 1e-6);
  EXPECT_NEAR(check.cost, accurate.cost.total(), 1e-3 * check.cost);
  EXPECT_GT(shoot_accurately(solved("square_90", "deterministic", "variational")).end_error, 1e-4);
}

TEST(AccurateShot, AgreesWithEveryKernel) {
  const BankProblem problem = problem_of("square_90");
  const MatchingPair shapes = problem.shapes();
  for (const char* kernel :
       {"peakon:alpha=2", "matern32:alpha=1", "matern52:alpha=1", "gaussian:alpha=1,weight=0.5+matern52:alpha=2"}) {
    RegistrationOptions options = problem.options;
    options.kernel = kernel;
    options.integrator = "rk4";
    options.grid.steps = 40;
    const Registration registration = register_shapes(shapes.source, shapes.target, options);
    const AccurateShot check = shoot_accurately(registration);
    EXPECT_LT(check.end_error, 1e-5) << kernel;
    EXPECT_NEAR(check.cost, registration.cost.total(), 0.01 * check.cost) << kernel;
  }
}

// Controls constant in each step of the record: those of the midpoint rule, to its second order.
TEST(AccurateShot, TakesTheRecordedIncrementsAsControls) {
  for (const char* name : {"swap_beta2", "p_sd_map", "ch_sd_screened_map", "trouve_vialard"}) {
    const Registration registration = solved(name, "map", "midpoint");
    const AccurateShot check = shoot_accurately(registration);
    EXPECT_LT(check.end_error, 1e-4) << name;
    EXPECT_NEAR(check.cost, registration.cost.total(), 0.01 * check.cost) << name;
  }
}

// p0 of metamorphosis alone, with a kernel, noise and integrator of the check's own, also where errors grow fifty-fold.
TEST(AccurateShot, ReproducesMetamorphosisByItsMomentaAlone) {
  for (const char* name : {"swap_beta0.5", "permutation_11", "p_sd", "ch_sd_screened", "crescent_beta0.1"}) {
    const Registration registration = solved(name, "metamorphosis", "auto");
    const AccurateShot check = shoot_accurately(registration);
    EXPECT_LT(check.end_error * diameter(registration.source.points), 0.1 * registration.sigma) << name;
    EXPECT_NEAR(check.cost, registration.cost.total(), 5e-3 * check.cost) << name;
  }
}

}  // namespace
}  // namespace pulson::matching
