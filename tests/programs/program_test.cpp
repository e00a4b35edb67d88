// The program as a user meets it: it runs as a process of its own, and what it prints, writes and returns is looked at.

#include "program.hpp"

#include <cmath>
#include <numbers>
#include <ostream>
#include <regex>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <sched.h>

#include "pulson/formats/landmark_files.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using testing::AnyOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class RegisterProgram : public Program {
 protected:
  static Arguments register_pair(const std::string& name, const std::string& options = "") {
    return joined({"register", sample(name + "_source"), sample(name + "_target"), "-o", "out"}, words(options));
  }

  static void expect_all_results() {
    EXPECT_THAT(names_in("out"), ElementsAre("registration.json", "registration.png", "registration.svg", "report.html",
                                             "residuals.csv", "trajectory.csv"));
    EXPECT_THAT(contents("out/registration.png"), StartsWith("\x89PNG\r\n\x1a\n"));
    const std::string svg = contents("out/registration.svg");
    EXPECT_THAT(svg.substr(0, 600), HasSubstr("<svg"));
    EXPECT_THAT(svg, HasSubstr("</svg>"));
    EXPECT_THAT(svg, HasSubstr(", before "));
    const nlohmann::json record = read_json("out/registration.json");
    ASSERT_TRUE(record.is_object());
    const std::size_t landmarks = record["source"].size();
    const std::size_t steps = record["steps"];
    EXPECT_EQ(count_lines(contents("out/residuals.csv")), landmarks + 1);
    EXPECT_EQ(count_lines(contents("out/trajectory.csv")), landmarks * (steps + 1) + 1);
  }

  /// Registers, and expects shapes that were brought together, with no warning.
  static nlohmann::json expect_match(const Arguments& arguments) {
    const ProgramRun done = run(arguments);
    EXPECT_EQ(done.exit_code, 0);
    EXPECT_EQ(done.err, "");
    expect_all_results();
    const nlohmann::json record = read_json("out/registration.json");
    EXPECT_EQ(record.value("converged", false), true);
    EXPECT_EQ(record.value("matched", false), true);
    EXPECT_LE(record.value("rms", 1e9), 3 * record.value("sigma", 0.0));
    EXPECT_LT(record.value("rms", 1e9), 0.7 * record.value("initial_rms", 0.0));
    EXPECT_THAT(done.out, HasSubstr("converged"));
    return record;
  }
};

constexpr const char* kSwapOptions = "--kernel gaussian:alpha=1 --sigma 0.01 --lambda 1 --steps 20";

TEST_F(RegisterProgram, LetsTwoPointsOfTheLineChangePlaces) {
  const auto swap = [](const std::string& noise) {
    return expect_match(joined(register_pair("swap", kSwapOptions), {"--noise", noise}));
  };
  const nlohmann::json one = swap("ch-sd:beta=1");
  EXPECT_NEAR(one["cost"]["total"], 0.8132, 0.0005);  // in closed form
  EXPECT_LT(one["rms"], 0.001);
  EXPECT_EQ(one["order_inversions"], 1);
  EXPECT_EQ(one["mode"], "metamorphosis");
  EXPECT_EQ(one["increments"].size(), 20U);
  const nlohmann::json two = swap("ch-sd:beta=2");
  EXPECT_NEAR(two["cost"]["total"], 0.2355, 0.0005);
  EXPECT_LT(two["rms"], 0.001);
  EXPECT_EQ(two["order_inversions"], 1);
}

TEST_F(RegisterProgram, SaysThatWithoutNoiseTheyDoNot) {
  const ProgramRun done = run(register_pair("swap", kSwapOptions));
  ASSERT_TRUE(fs::exists("out/registration.json")) << done.err;
  const nlohmann::json record = read_json("out/registration.json");
  EXPECT_EQ(done.exit_code, record["converged"] ? 0 : 3) << done.err;
  EXPECT_EQ(record["matched"], false);
  EXPECT_GT(record["rms"], 0.4);
  EXPECT_EQ(record["order_inversions"], 0);
  EXPECT_THAT(done.err, HasSubstr("not matched"));
  EXPECT_THAT(done.err, HasSubstr("--noise"));
  expect_all_results();
}

TEST_F(RegisterProgram, MarksWhatDidNotConverge) {
  const ProgramRun done = run(register_pair("cs", "--max-iterations 1 --kernel gaussian:alpha=5%"));
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_THAT(done.err, HasSubstr("not converged"));
  EXPECT_EQ(read_json("out/registration.json")["converged"], false);
  expect_all_results();
}

// Where no step helps, the shape that stands still is a better answer than one further away.
TEST_F(RegisterProgram, DoesNoWorseThanStandingStill) {
  const ProgramRun done =
      run(register_pair("swap", "--kernel gaussian:alpha=0.5 --sigma 0.001 --steps 5 --no-picture"));
  EXPECT_THAT(done.exit_code, AnyOf(0, 3)) << done.err;
  const nlohmann::json record = read_json("out/registration.json");
  ASSERT_TRUE(record.is_object());
  EXPECT_LE(record["rms"], record["initial_rms"]);
  EXPECT_LE(record["cost"]["total"], 1e6);  // ½ Σ |residual|²/σ² where nothing moves
}

struct SamplePair {
  std::string name;
  std::string options{};
};

std::ostream& operator<<(std::ostream& stream, const SamplePair& pair) { return stream << pair.name; }

class SamplePairs : public RegisterProgram, public testing::WithParamInterface<SamplePair> {};

TEST_P(SamplePairs, Register) { expect_match(register_pair(GetParam().name, GetParam().options)); }

INSTANTIATE_TEST_SUITE_P(
    Sample, SamplePairs,
    testing::Values(SamplePair{"fish"}, SamplePair{"hand"}, SamplePair{"cs"}, SamplePair{"ellipse"},
                    SamplePair{"discs", "--noise ch-sd:beta=2 --kernel gaussian:alpha=0.25 --lambda 60"}),
    kName);

TEST_F(RegisterProgram, RegistersRealShapesOfOneFile) {
  const fs::path gorf = data_folder() / "shapes_R" / "gorf.dat.csv";
  const fs::path salamander = data_folder() / "tps_geomorph_course" / "PlethodonLand.tps";
  if (!fs::exists(gorf) || !fs::exists(salamander)) GTEST_SKIP() << "no " << gorf << " or no " << salamander;
  const nlohmann::json skull =
      expect_match(joined({"register", gorf.string() + "#1", gorf.string() + "#2", "-o", "out"},
                          words("--align similarity --kernel gaussian:alpha=auto")));
  EXPECT_EQ(skull["alignment"]["kind"], "similarity");
  EXPECT_THAT(skull["kernel"], testing::MatchesRegex("gaussian:alpha=[0-9.]+"));
  expect_match({"register", salamander.string() + "#1", salamander.string() + "#2", "-o", "out"});
}

TEST_F(RegisterProgram, RegistersRealShapesInSpace) {
  const fs::path scallops = data_folder() / "tps_geomorph_course" / "scallops for viz.tps";
  if (!fs::exists(scallops)) GTEST_SKIP() << "no " << scallops << "; PULSON_DATA may name the folder with the data";
  for (const std::string number : {"1", "2"}) {  // every fourth landmark, to save time
    const Points all = formats::read_landmarks(scallops.string() + "#" + number).points;
    Landmarks some;
    some.points = all(Eigen::all, Eigen::seq(0, Eigen::last, 4));
    formats::write_landmarks_csv(number + ".csv", some);
  }
  const nlohmann::json record = expect_match({"register", "1.csv", "2.csv", "-o", "out"});
  EXPECT_EQ(record["result"].size(), 51U);
  EXPECT_EQ(record["result"][0].size(), 3U);
  EXPECT_TRUE(record["flipped_triangles"].is_null());
}

TEST_F(RegisterProgram, PrintsOnlyTheRecordForScripts) {
  const ProgramRun done = run(register_pair("ellipse", "--steps 10 --no-picture --json -"));
  EXPECT_EQ(done.exit_code, 0);
  EXPECT_EQ(done.err, "");
  EXPECT_EQ(done.out, contents("out/registration.json"));
  const nlohmann::json record = nlohmann::json::parse(done.out, nullptr, false);
  ASSERT_TRUE(record.is_object());
  for (const char* key : {"kernel",
                          "noise",
                          "mode",
                          "integrator",
                          "steps",
                          "time",
                          "sigma",
                          "lambda",
                          "converged",
                          "iterations",
                          "seconds",
                          "cost",
                          "rms",
                          "max_residual",
                          "source",
                          "target",
                          "result",
                          "momenta",
                          "increments",
                          "order_inversions",
                          "flipped_triangles"})
    EXPECT_TRUE(record.contains(key)) << key;
  for (const char* key : {"total", "energy", "action", "data"}) EXPECT_TRUE(record["cost"].contains(key)) << key;
}

TEST_F(RegisterProgram, WritesTheRecordElsewhereToo) {
  const ProgramRun done = run(register_pair("swap", "--noise ch-sd:beta=2 --no-picture --json copy.json"));
  EXPECT_EQ(done.exit_code, 0);
  EXPECT_THAT(done.out, HasSubstr("rms"));
  EXPECT_EQ(contents("copy.json"), contents("out/registration.json"));
  EXPECT_THAT(names_in("out"), ElementsAre("registration.json", "report.html", "residuals.csv", "trajectory.csv"));
}

TEST_F(RegisterProgram, IsQuietWhenAsked) {
  for (const char* option : {"--quiet", "-q"}) {
    const ProgramRun done = run(register_pair("swap", "--noise ch-sd:beta=2 --no-picture " + std::string(option)));
    EXPECT_EQ(done.exit_code, 0);
    EXPECT_EQ(done.out + done.err, "");
  }
  const ProgramRun warned = run(register_pair("swap", "--no-picture --quiet"));
  EXPECT_EQ(warned.out, "");
  EXPECT_THAT(warned.err, HasSubstr("not matched"));
}

TEST_F(RegisterProgram, TakesTheLongestTimeStep) {
  const auto steps = [](const std::string& options) {
    const ProgramRun done = run(register_pair("swap", "--noise ch-sd:beta=2 --no-picture " + options));
    EXPECT_THAT(done.exit_code, AnyOf(0, 3)) << done.err;
    return read_json("out/registration.json").value("steps", 0);
  };
  EXPECT_EQ(steps("--dt 0.1"), 10);
  EXPECT_EQ(steps("--dt 0.3"), 4);
  EXPECT_EQ(steps("--dt 0.1 --time 2"), 20);
  EXPECT_EQ(steps("--dt 5"), 1);
  EXPECT_EQ(steps("--steps 7"), 7);
}

TEST_F(RegisterProgram, FindsTheSameWithAnyNumberOfThreads) {
  const auto record = [](const std::string& threads) {
    const ProgramRun done = run(register_pair(
        "discs", "--noise ch-sd:beta=2 --kernel gaussian:alpha=0.25 --lambda 60 --no-picture --threads " + threads));
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return std::regex_replace(contents("out/registration.json"), std::regex("\"seconds\": [^,]*,"), "");
  };
  const std::string one = record("1");
  EXPECT_THAT(one, HasSubstr("\"momenta\""));
  EXPECT_EQ(record("2"), one);
  EXPECT_EQ(record("3"), one);
}

TEST_F(RegisterProgram, ReportsWhatAnAccurateIntegratorMakesOfTheMomenta) {
  const std::string discs = "--align none --noise ch-sd:beta=1 --kernel gaussian:alpha=0.4 --lambda 1 --sigma 0.01 ";
  for (const char* reproduced : {"discs", "fish"}) {
    const ProgramRun accurate = run(register_pair(reproduced, (reproduced[0] == 'd' ? discs : "") + "--no-picture"));
    EXPECT_EQ(accurate.exit_code, 0);
    EXPECT_EQ(accurate.err, "");
    EXPECT_THAT(accurate.out, Not(HasSubstr("accuracy")));
  }
  const std::string coarse_shot = "--integrator variational --steps 20 --kernel gaussian:alpha=0.1 --no-picture";
  const ProgramRun coarse = run(register_pair("fish", coarse_shot));
  EXPECT_THAT(coarse.out, HasSubstr("\naccuracy   an accurate integrator ends 0.009"));
  EXPECT_THAT(coarse.err, StartsWith("warning: shot by an accurate integrator, p0 ends 0.009"));
  EXPECT_THAT(coarse.err, HasSubstr(" times as large: try --integrator auto or more --steps\n"));
}

// The path is the result there, which more steps do not change.
TEST_F(RegisterProgram, SaysThatMomentaAloneDoNotReproduceAPath) {
  std::string circle = "x,y\n", band = "x,y\n";  // which is bent to a whole turn
  for (int a = 0; a < 12; ++a) {
    const double x = std::cos(std::numbers::pi * a / 6), y = std::sin(std::numbers::pi * a / 6);
    const double angle = std::numbers::pi - 2 * std::asin(y), radius = 0.8 - 0.3 * x;
    circle += fmt::format("{},{}\n", x, y);
    band += fmt::format("{},{}\n", radius * std::cos(angle), radius * std::sin(angle));
  }
  write("circle.csv", circle);
  write("band.csv", band);
  const ProgramRun path =
      run(words("register circle.csv band.csv -o out --align none --kernel gaussian:alpha=0.6 "
                "--lambda 1 --sigma 0.002 --steps 20 --no-picture"));
  EXPECT_THAT(path.out,
              HasSubstr("\naccuracy   p0 alone does not reproduce the path: shot by an accurate integrator, "));
  EXPECT_THAT(path.err, Not(HasSubstr("p0")));
  EXPECT_THAT(path.err, Not(HasSubstr("--steps")));
  const ProgramRun shot = run(words("simulate --from out/registration.json -o shot --no-picture"));
  EXPECT_THAT(shot.err, HasSubstr("of the registration: p0 alone does not reproduce the path"));
}

TEST_F(RegisterProgram, NamesMetamorphosisWhereModeMapDoesNotConverge) {
  const std::string discs = "--align none --noise ch-sd:beta=1 --kernel gaussian:alpha=0.4 --lambda 1 --sigma 0.01 ";
  const ProgramRun done = run(register_pair("discs", discs + "--mode map --no-picture"));
  EXPECT_EQ(done.exit_code, 3);
  EXPECT_THAT(done.err, StartsWith("warning: not converged: "));
  EXPECT_THAT(done.err,
              HasSubstr("; mode map may have no minimum here: try --mode metamorphosis, or a larger --lambda\n"));
}

TEST_F(RegisterProgram, FindsLandmarksThatAreAtRandom) {
  Landmarks source, target;
  source.points = Points(2, 40), target.points = Points(2, 40);
  for (int a = 0; a < 40; ++a) {
    const int other = a * 13 % 40;
    source.points.col(a) << std::cos(0.15 * a), std::sin(0.15 * a);
    target.points.col(a) << std::cos(0.15 * other), 0.5 * std::sin(0.15 * other);
  }
  formats::write_landmarks_csv("source.csv", source);
  formats::write_landmarks_csv("target.csv", target);
  const ProgramRun done = run({"register", "source.csv", "target.csv", "-o", "out", "--no-picture", "--lambda", "1e6"});
  EXPECT_THAT(done.err,
              StartsWith("warning: target.csv: its landmarks have nothing in common with those of the same number"));
  EXPECT_THAT(done.err, HasSubstr("\nwarning: not matched: "));
  EXPECT_THAT(done.err, HasSubstr("; neighbouring landmarks do not move together: check that landmarks correspond"));
}

// All that its help and docs name.
TEST_F(RegisterProgram, TakesEveryModeAndSolver) {
  Landmarks two, near;
  two.points = Points{{0, 1}}, near.points = Points{{0.1, 1.2}};
  formats::write_landmarks_csv("two.csv", two);
  formats::write_landmarks_csv("near.csv", near);
  for (const char* choice :
       {"--mode deterministic", "--mode metamorphosis", "--mode map", "--mode pathwise", "--mode expected",
        "--solver auto", "--solver paths", "--solver gauss-newton", "--solver lbfgs"}) {
    SCOPED_TRACE(choice);
    const ProgramRun done = run(joined({"register", "two.csv", "near.csv", "-o", "out", "--no-picture", "--noise",
                                        "ch-sd:beta=1%", "--kernel", "gaussian:alpha=1", "--sigma", "0.1"},
                                       words(choice)));
    EXPECT_TRUE(done.exit_code == 0 || done.exit_code == 3) << done.err;
  }
}

// Noise that stays diffeomorphic does not let them through either, and what is drawn cannot be fitted away.
TEST_F(RegisterProgram, AdvisesByWhatTheNoiseCanDo) {
  Landmarks two, swapped, near;
  two.points = Points{{0, 1}}, swapped.points = Points{{1, 0}}, near.points = Points{{0.1, 1.2}};
  formats::write_landmarks_csv("two.csv", two);
  formats::write_landmarks_csv("swapped.csv", swapped);
  formats::write_landmarks_csv("near.csv", near);
  const auto warned = [&](const std::string& target, const std::string& noise, const std::string& mode) {
    return run({"register", "two.csv", target, "-o", "out", "--no-picture", "--noise", noise, "--mode", mode,
                "--kernel", "gaussian:alpha=1", "--sigma", "0.1", "--lambda", "1"})
        .err;
  };
  EXPECT_THAT(warned("swapped.csv", "p-sd:beta=10%", "metamorphosis"),
              HasSubstr("1 pair of landmarks has a different order in the target, which no flow can reach: try --noise "
                        "ch-sd:beta=100%"));
  EXPECT_THAT(warned("near.csv", "ch-sd:beta=100%", "expected"),
              AllOf(HasSubstr("over the realisations a landmark ends 0.9"),
                    HasSubstr(" from its mean, rms: try a smaller amplitude, or noise that is fitted: "
                              "--mode metamorphosis\n")));
}

// The program inherits the affinity of this process.
class OnOneCore {
 public:
  OnOneCore() {
    sched_getaffinity(0, sizeof(all_), &all_);
    cpu_set_t one;
    CPU_ZERO(&one);
    for (int core = 0; CPU_COUNT(&one) == 0; ++core)
      if (CPU_ISSET(core, &all_)) CPU_SET(core, &one);
    sched_setaffinity(0, sizeof(one), &one);
  }
  ~OnOneCore() { sched_setaffinity(0, sizeof(all_), &all_); }

 private:
  cpu_set_t all_;
};

TEST_F(RegisterProgram, TakesNoMoreThreadsThanTheCoresItMayRunOn) {
  EXPECT_EQ(run(register_pair("fish", "--no-picture --threads 64")).err, "");
  const OnOneCore one_core;
  EXPECT_EQ(run(register_pair("fish", "--no-picture")).err, "");
  EXPECT_EQ(run(register_pair("fish", "--no-picture --threads 3")).err, "");
  EXPECT_THAT(run({"--version"}).out, testing::ContainsRegex("threads +1\n"));
}

TEST_F(RegisterProgram, TakesFileNamesAsTheyCome) {
  fs::copy(sample("swap_source"), "odd '#1, ü.csv");
  fs::copy(sample("swap_target"), "it's \"x\".csv");
  const ProgramRun done =
      run({"register", "odd '#1, ü.csv", "it's \"x\".csv", "-o", "new folder/of #2", "--noise", "ch-sd:beta=2"});
  EXPECT_EQ(done.exit_code, 0);
  EXPECT_EQ(done.err, "");
  EXPECT_EQ(names_in("new folder/of #2").size(), 6U);
}

}  // namespace
}  // namespace pulson
