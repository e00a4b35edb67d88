// The verbs `reproduce` and `fokker-planck`: what they write, claim and refuse.

#include <gmock/gmock.h>

#include "program.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

constexpr const char* kGrid =
    "fokker-planck --q 0,10 --p 4,1 --kernel gaussian:alpha=1 --noise ch-sd:beta=1.5,on=2 -o out ";

class Reproduce : public Program {
 protected:
  static void expect_refused(const std::string& line, const std::string& message) {
    const auto before = all_files();
    const ProgramRun refused = run(words(line));
    EXPECT_EQ(refused.exit_code, 2) << line;
    EXPECT_THAT(refused.err, HasSubstr(message));
    EXPECT_EQ(count_lines(refused.err), 1U);
    EXPECT_THAT(changed_since(before), testing::IsEmpty());
  }

  /// The fields of the csv row that begins with `key`.
  static std::vector<std::string> row(const std::string& csv, const std::string& key) {
    const std::size_t begin = csv.find("\n" + key);
    if (begin == std::string::npos) return {};
    std::istringstream line(csv.substr(begin + 1, csv.find('\n', begin + 1) - begin - 1));
    std::vector<std::string> fields;
    for (std::string field; std::getline(line, field, ',');) fields.push_back(field);
    return fields;
  }
};

TEST_F(Reproduce, WritesPicturesNumbersAndAReportWithVerdicts) {
  const ProgramRun done = run(words("reproduce figure1 --quick --samples 256 -o out"));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(names_in("out"), ElementsAre("figure1.csv", "figure1.png", "figure1.svg", "report.html"));
  EXPECT_THAT(done.out, HasSubstr("holds          The faster pulson may in fact cross the slower one."));
  EXPECT_THAT(done.out, HasSubstr("0 of 8 deterministic runs"));
  const std::string report = contents("out/report.html");
  EXPECT_THAT(report, AllOf(StartsWith("<!DOCTYPE html>"), HasSubstr("pulson reproduce figure1 -o out --quick"),
                            HasSubstr("data:image/svg+xml"), Not(HasSubstr("src=\"http"))));
  EXPECT_THAT(contents("out/figure1.csv"), StartsWith("path,time,q1,q2,p1,p2\n1,0,0,10,4,1\n"));
  EXPECT_EQ(count_lines(contents("out/figure1.csv")), 1 + 3 * 5001U);
}

TEST_F(Reproduce, ChecksTheClaimsOnCrossing) {
  const ProgramRun done = run(words("reproduce figure3 --quick --samples 1024 --no-picture -o out"));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("does not hold  The probability of crossing seems to approach unity"));
  EXPECT_THAT(done.out, HasSubstr("holds          It seems to approach 0.5 for"));
  const std::string csv = contents("out/figure3.csv");
  EXPECT_EQ(count_lines(csv), 1 + 2 * 4 * 14U);
  // The reference's Monte Carlo, 50,048 samples, and the grid.
  const std::vector<std::string> point = row(csv, "gaussian:alpha=1,4,2,");
  ASSERT_EQ(point.size(), 11U);
  EXPECT_NEAR(std::stod(point[5]), 0.4026, 5 * std::stod(point[6]));
  EXPECT_NEAR(std::stod(point[9]), 0.4047, 0.01);
  EXPECT_EQ(row(csv, "peakon:alpha=0.5,8,0,")[5], "0");
}

TEST_F(Reproduce, TellsWhatCouldNotBeTested) {
  const ProgramRun done = run(words("reproduce section5.4 --quick --samples 64 --no-picture -o out"));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("holds          h = β(p₁ + p₂): Gaussian pulsons do not cross"));
  EXPECT_THAT(done.out, HasSubstr("not tested     h = β q₂: Gaussian pulsons do not cross"));
  EXPECT_THAT(contents("out/section5.4.csv"), HasSubstr("\np-sd,gaussian,6.5,64,0,0,64,0,0,"));
}

TEST_F(Reproduce, IsTheSameForAnyNumberOfThreads) {
  for (const char* threads : {"1", "3"})
    run(words(std::string("reproduce figure2 --quick --samples 256 --no-picture --quiet --threads ") + threads +
              " -o out" + threads));
  EXPECT_GT(contents("out1/figure2.csv").size(), 10000U);
  EXPECT_TRUE(contents("out1/figure2.csv") == contents("out3/figure2.csv"));
}

TEST_F(Reproduce, RefusesWhatItCannotDo) {
  expect_refused("reproduce figure5 -o out", "unknown experiment 'figure5'; did you mean 'figure");
  expect_refused("reproduce figure1 --samples 3 -o out", "--samples is 3; it must be from 64");
  expect_refused("reproduce figure1 --dt 0 -o out", "--dt is 0; it must be from");
  expect_refused("reproduce figure1", "--out is required");
}

TEST_F(Reproduce, FindsTheCrossingProbabilityOnAGrid) {
  const ProgramRun done = run(words(std::string(kGrid) + "--samples 4096"));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(names_in("out"), ElementsAre("crossing.csv", "densities.csv", "fokker_planck.json", "fokker_planck.png",
                                           "fokker_planck.svg", "report.html"));
  const nlohmann::json record = read_json("out/fokker_planck.json");
  EXPECT_NEAR(record["probability"], 0.2747, 0.001);
  EXPECT_LT(record["error"], 0.001);
  EXPECT_EQ(record["converged"], true);
  EXPECT_GE(record["grids"].size(), 3U);
  EXPECT_NEAR(record["sampled"]["probability"], 0.2747, 5 * record["sampled"]["standard_error"].get<double>());
  EXPECT_THAT(contents("out/crossing.csv"), StartsWith("time,probability,sampled,standard_error\n0,0,0,NA\n"));
  EXPECT_THAT(contents("out/densities.csv"), StartsWith("landmark,time,q,density\n2,10,"));
}

TEST_F(Reproduce, SaysSoWhereTheGridIsTooCoarse) {
  const ProgramRun done = run(words(std::string(kGrid) + "--tolerance 1e-7 --grids 2 --no-picture"));
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_THAT(done.err, HasSubstr("warning: the stated error"));
  EXPECT_EQ(read_json("out/fokker_planck.json")["converged"], false);
}

TEST_F(Reproduce, PrintsTheDigitsOfASmallProbability) {
  const ProgramRun done =
      run(words("fokker-planck --q 0,2 --p 1,0.5 --time 0.5 --kernel gaussian:alpha=1 "
                "--noise ch-sd:beta=0.6,on=2 --grids 2 --no-picture -o out"));
  const double probability = read_json("out/fokker_planck.json")["probability"];
  EXPECT_LT(probability, 1e-4);
  double printed = 0, error = 0;
  ASSERT_EQ(std::sscanf(done.out.c_str(), "crossing %lf ± %lf", &printed, &error), 2) << done.out;
  EXPECT_NEAR(printed, probability, error / 10);
  EXPECT_NEAR(error, read_json("out/fokker_planck.json")["error"], error / 10);
}

TEST_F(Reproduce, RefusesPairsThatTheGridDoesNotKnow) {
  const std::string kernel = " --kernel gaussian:alpha=1 -o out";
  expect_refused("fokker-planck --q 0,10 --p 4,-1 --noise ch-sd:beta=1" + kernel, "both positive or both negative");
  expect_refused("fokker-planck --q 0,10,20 --p 4,1,1 --noise ch-sd:beta=1" + kernel, "two landmarks on a line");
  expect_refused("fokker-planck --q 0/0,1/0 --p 1/0,1/0 --noise ch-sd:beta=1" + kernel, "two landmarks on a line");
  expect_refused("fokker-planck --q 0,10 --p 4,1 --noise p-sd:beta=1" + kernel, "independent noise of constant size");
  expect_refused("fokker-planck --q 0,10 --p 4,1 --noise trouve-vialard:sigma=1" + kernel, "independent noise");
  expect_refused("fokker-planck --q 0,10 --p 4,1 --noise ch-sd:beta=1 --time 0" + kernel, "time");
  expect_refused("fokker-planck --q 0,10 --p 4,1 --noise ch-sd:beta=1 --grids 1" + kernel, "2");
}

}  // namespace
}  // namespace pulson
