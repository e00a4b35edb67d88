// What the verb `ensemble` refuses: in one line, with nothing written.

#include <ostream>

#include <gmock/gmock.h>

#include "ensemble_program.hpp"

namespace pulson {
namespace {

using testing::HasSubstr;
using testing::IsEmpty;
using testing::StartsWith;

class EnsembleErrors : public EnsembleProgram {
 protected:
  static void expect_refused(const std::string& line, const std::string& part) {
    const auto before = all_files();
    const ProgramRun done = run(words(line));
    EXPECT_EQ(done.exit_code, 2) << line;
    EXPECT_EQ(done.out, "");
    EXPECT_EQ(count_lines(done.err), 1U) << done.err.substr(0, 500);
    EXPECT_THAT(done.err.substr(0, 500), StartsWith("pulson: "));
    EXPECT_THAT(done.err.substr(0, 500), HasSubstr(part));
    EXPECT_LT(done.err.size(), 500U) << "one line that a person can read";
    EXPECT_THAT(changed_since(before), IsEmpty());
  }
};

struct WrongEnsemble {
  const char* options;
  const char* part;
};
std::ostream& operator<<(std::ostream& out, const WrongEnsemble& wrong) { return out << wrong.options; }

class WrongEnsembles : public EnsembleErrors, public testing::WithParamInterface<WrongEnsemble> {};

TEST_P(WrongEnsembles, AreRefused) {
  write("a_file", "");
  std::filesystem::create_directory("folder");
  expect_refused(std::string(kPair) + GetParam().options, GetParam().part);
}

INSTANTIATE_TEST_SUITE_P(
    Line, WrongEnsembles,
    testing::Values(
        WrongEnsemble{"", "--out"}, WrongEnsemble{"-o out --samples 0", "--samples is 0; it must be from 1 to"},
        WrongEnsemble{"-o out --samples -5", "--samples is -5"},
        WrongEnsemble{"-o out --samples 20000000000", "--samples is 20000000000"},
        WrongEnsemble{"-o out --samples many", "--samples"},
        WrongEnsemble{"-o out --samples 7 --antithetic", "--samples is 7; with --antithetic it must be even"},
        WrongEnsemble{"-o out --densities 200", "--densities: 200 is not a time from 0 to 100"},
        WrongEnsemble{"-o out --densities 1,-1", "--densities: -1 is not a time from 0 to 100"},
        WrongEnsemble{"-o out --densities nan", "--densities: nan is not a time"},
        WrongEnsemble{"-o out --records 1", "--records is 1; it must be at least 2"},
        WrongEnsemble{"-o out --records -3", "--records is -3"},
        WrongEnsemble{"-o out --bound 0", "--bound is 0; it must be greater than 0"},
        WrongEnsemble{"-o out --bound nan", "--bound is nan"},
        WrongEnsemble{"-o out --stop-after 0", "--stop-after is 0; it must be at least 1"},
        WrongEnsemble{"-o out --save-paths all.npy --samples 10000000", "the states to keep are 4040000000 numbers"},
        WrongEnsemble{"-o out --save-final ends.npy --samples 1000000000", "the states to keep are"},
        WrongEnsemble{"-o out --save-final nowhere/ends.npy", "there is no folder 'nowhere'"},
        WrongEnsemble{"-o out --save-paths folder", "'folder'"}, WrongEnsemble{"-o a_file", "'a_file'"},
        WrongEnsemble{"-o /dev/null/out", "'/dev/null/out'"}, WrongEnsemble{"-o out --json folder", "'folder'"},
        WrongEnsemble{"-o out --json nowhere/x.json", "there is no folder 'nowhere'"},
        WrongEnsemble{"-o out --integrator eular", "unknown integrator 'eular'"},
        WrongEnsemble{"-o out --integrator rk4", "integrator 'rk4' takes no noise"},
        WrongEnsemble{"-o out --threads -1", "--threads is -1"}, WrongEnsemble{"-o out --seed x", "--seed is 'x'"},
        WrongEnsemble{"-o out --dt 0", "--dt is 0"}, WrongEnsemble{"-o out --nosuch", "--nosuch"}));

TEST_F(EnsembleErrors, WrongStartsAreRefused) {
  write("five.csv", "x,y\n0,0\n1,0\n1,1\n0,1\n0.5,1.5\n");
  expect_refused("ensemble -o out", "an initial state is needed: --q, --shape or --from");
  expect_refused("ensemble --q 0,0 --kernel gaussian:alpha=1 -o out", "landmarks 1 and 2 are at the same position");
  expect_refused("ensemble --q 0,1 --p 1 -o out", "--p has 1 landmarks in 1D, the positions 2 in 1D");
  expect_refused("ensemble --shape none.csv -o out", "none.csv");
  expect_refused("ensemble --shape five.csv --noise ch-sd:beta=1,on=6 -o out", "on=6");
  expect_refused("ensemble --q 0,1 --noise langevi:sigma=1 -o out", "unknown noise 'langevi'");
}

// Another ensemble's sums in the folder are left alone.
TEST_F(EnsembleErrors, SumsOfAnotherAreRefused) {
  const std::string kShort = kPair + std::string("--time 10 --threads 1 -o out ");
  const std::string kRun = kShort + "--samples 1000 ";
  ASSERT_EQ(run(words(kRun + "--stop-after 1")).exit_code, 3);
  expect_refused(kRun + "--resume --seed 2",
                 "'out/ensemble.partial' holds another ensemble: its seed is 1, here it is 2");
  expect_refused("ensemble --q 0,10 --p 4,1 --kernel gaussian:alpha=1 --no-picture -o out --resume",
                 "its noise is \"ch-sd:beta=1.5,on=2\", here it is \"none\"");
  expect_refused(kShort + "--resume --samples 2000", "its samples is 1000, here it is 2000");
  expect_refused(kRun + "--resume --dt 0.01", "its steps is 500, here it is 1000");
  expect_refused(kRun + "--resume --integrator midpoint", "its integrator is");
  expect_refused(kRun + "--resume --antithetic", "its antithetic is false, here it is true");
  expect_refused(kRun + "--resume --records 7", "its records");
  expect_refused(kRun + "--resume --save-final ends.npy", "its keep is 0, here it is 1");
  const std::string saved = contents("out/ensemble.partial");
  write("out/ensemble.partial", saved.substr(0, saved.size() / 2));
  expect_refused(kRun + "--resume", "'out/ensemble.partial' is damaged");
  write("out/ensemble.partial", "");
  expect_refused(kRun + "--resume", "'out/ensemble.partial' is damaged");
  write("out/ensemble.partial", saved);
  EXPECT_EQ(run(words(kRun + "--resume")).exit_code, 0);
}

// One result that cannot be written must not leave the others behind, nor be found out after the work.
TEST_F(EnsembleErrors, ResultsAreWrittenAllOrNone) {
  for (const std::string name : {"ensemble.json", "means.csv", "densities.csv", "ensemble.partial"}) {
    std::filesystem::create_directories("out/" + name);
    expect_refused(kPair + std::string("--samples 64 --time 1 -o out"), "'out/" + name + "'");
    std::filesystem::remove_all("out");
  }
}

// What was sampled is not to be lost where a result cannot be written in the end.
TEST_F(EnsembleErrors, SumsOutliveResultsThatCannotBeWritten) {
  if (!std::filesystem::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full";
  const std::string kRun = kPair + std::string("--samples 1000 --time 10 --threads 1 -o out ");
  ASSERT_EQ(run(words(kRun + "--stop-after 1")).exit_code, 3);
  const ProgramRun full = run(words(kRun + "--resume --json /dev/full"));
  EXPECT_EQ(full.exit_code, 2);
  EXPECT_EQ(count_lines(full.err), 1U);
  EXPECT_TRUE(std::filesystem::exists("out/ensemble.partial"));
}

// A run that was not finished is not overwritten.
TEST_F(EnsembleErrors, AnUnfinishedRunIsKept) {
  EXPECT_EQ(run_pair("--time 1 --samples 640 --stop-after 64 -o out").exit_code, 3);
  const auto before = all_files();
  const ProgramRun refused = run_pair("--time 1 --samples 128 -o out");
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, testing::HasSubstr("ensemble.partial' belongs to an unfinished run"));
  EXPECT_TRUE(changed_since(before).empty());
}

}  // namespace
}  // namespace pulson
