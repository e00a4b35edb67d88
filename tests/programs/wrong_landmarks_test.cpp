// Landmarks that are wrong as a whole are named: undigitised specimens, exchanged or reversed landmarks, mirror images,
// other units; and slips on the command line that point at them.

#include <cmath>
#include <fstream>

#include <gmock/gmock.h>

#include "program.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::ContainsRegex;
using testing::HasSubstr;
using testing::Not;

class WrongLandmarks : public Program {
 protected:
  static std::string leaves_file() {
    return (std::filesystem::path(PULSON_SOURCE_DIR) / "sample_shapes" / "leaves.tps").string();
  }

  /// The eight leaves, one of them changed, as leaves.csv.
  template <class Change>
  static void write_leaves(std::size_t which, const Change& change) {
    formats::LandmarkFile file = formats::read_landmark_file(leaves_file());
    change(file.shapes[which].points);
    formats::write_landmark_file("leaves.csv", file);
  }

  static ProgramRun run_line(const std::string& line) { return run(words(line + " -o out --no-picture")); }
};

TEST_F(WrongLandmarks, OfUndigitisedSpecimensAreLeftOutOfCohorts) {
  for (const double value : {0.0, -1.0, std::nan("")}) {
    write_leaves(4, [value](Points& points) { points.setConstant(value); });
    for (const std::string line : {"atlas leaves.csv", "register leaves.csv",
                                   "compare leaves.csv --noise none --no-maps --importance 10 --sigma 5 --folds 0"}) {
      const ProgramRun done = run_line(line);
      EXPECT_THAT(done.exit_code, testing::AnyOf(0, 3)) << done.err;
      EXPECT_THAT(done.err,
                  AllOf(HasSubstr("warning: 1 of 8 shapes is left out"), HasSubstr("'leaf_5' (leaves.csv#5)")))
          << line;
      EXPECT_THAT(done.out, HasSubstr("7 shapes")) << line;
    }
    const ProgramRun pair = run_line("register leaves.csv#1 leaves.csv#5");
    EXPECT_EQ(pair.exit_code, 2);
    EXPECT_THAT(pair.err, HasSubstr("leaves.csv#5 ('leaf_5'): all landmarks are at one point or missing"));
  }
}

TEST_F(WrongLandmarks, HaveNoInfluenceOnARobustFit) {
  write_leaves(1, [](Points& points) { points.col(9) += Eigen::Vector2d(60, -50); });
  const ProgramRun done = run_line("register leaves.csv#1 leaves.csv#2 --robust");
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("suspects   landmark 10 (weight 0.00)\n"));
  EXPECT_THAT(contents("out/residuals.csv"), HasSubstr(",weight\n"));
  const auto record = read_json("out/registration.json");
  EXPECT_EQ(record.at("loss"), "tukey:5.12299");
  EXPECT_EQ(record.at("weights").size(), 19U);
  EXPECT_LT(record.at("weights").at(9), 0.1);
  EXPECT_EQ(run(words("warp out leaves.csv#1 -o moved.csv")).exit_code, 0) << "the record is read again";
  for (const std::string line : {"--loss welsch", "--robust --sigma fit", "--loss huber --data varifold"})
    EXPECT_EQ(run_line("register leaves.csv#1 leaves.csv#2 " + line).exit_code, 2) << line;
  const ProgramRun atlas = run_line("atlas leaves.csv --robust");
  EXPECT_THAT(atlas.err, ContainsRegex("leaves.csv#2: .* wrong, of a weight below 0.1: .*10"));
  EXPECT_THAT(atlas.out, ContainsRegex("suspects    [0-9]+ landmarks? of [0-9] shapes?, by loss tukey:5.12299"));
  EXPECT_LT(read_json("out/atlas.json").at("specimens").at(1).at("weights").at(9), 0.1);
  EXPECT_EQ(run_line("atlas leaves.csv --robust --sigma 0").exit_code, 2);
}

TEST_F(WrongLandmarks, HaveNoInfluenceOnAComparisonOrAPosterior) {
  write_leaves(1, [](Points& points) { points.col(9) += Eigen::Vector2d(60, -50); });
  const std::string quick = "compare leaves.csv --noise none --no-maps --importance 10 --folds 0";
  const ProgramRun compared = run_line(quick + " --robust");
  EXPECT_EQ(compared.exit_code, 0) << compared.err;
  EXPECT_THAT(compared.err, ContainsRegex("note: leaves.csv#2: .* wrong, of a weight below 0.1: .*10"));
  const auto robust = read_json("out/comparison.json");
  EXPECT_EQ(robust.at("weights").size(), 8U);
  EXPECT_EQ(robust.at("weights").at(1).at(9), 0);
  const auto sigma_of = [](const auto& record) { return record.at("models").at(0).at("sigma").template get<double>(); };
  run_line(quick);
  const double with_it = sigma_of(read_json("out/comparison.json"));
  write_leaves(1, [](Points&) {});
  run_line(quick + " --robust");
  const auto without = read_json("out/comparison.json");
  const auto& fitted = without.at("models").at(0).at("fitted");
  ASSERT_EQ(fitted.back().at("name"), "data-sigma");
  const double deviation = fitted.back().at("log_deviation");  // 0.09
  EXPECT_LT(deviation, 0.15);
  EXPECT_LT(std::abs(std::log(sigma_of(robust) / sigma_of(without))), 2 * deviation);
  EXPECT_GT(with_it, 5 * sigma_of(without));
  write_leaves(1, [](Points& points) { points.col(9) += Eigen::Vector2d(60, -50); });
  EXPECT_THAT(run_line("compare leaves.csv#1 leaves.csv#2 --robust").err, HasSubstr("there is one; it takes 3"));
  EXPECT_THAT(run_line("compare leaves.csv --robust --simulate all").err, HasSubstr("--simulate draws them"));

  const ProgramRun sampled = run_line("sample leaves.csv#1 leaves.csv#2 --robust --draws 20 --warmup 10 --searches 1");
  EXPECT_THAT(sampled.err, HasSubstr("note: leaves.csv#2: 1 landmark looks wrong, of a weight below 0.1: 10"));
  EXPECT_LT(read_json("out/summary.json").at("weights").at(9), 0.1);
  EXPECT_THAT(run_line("sample leaves.csv#1 leaves.csv#2 leaves.csv#3 --robust").err,
              HasSubstr("a loss fits sigma to one target, and there are 2"));
}

TEST_F(WrongLandmarks, ThatAreExchangedAreNamed) {
  write_leaves(4, [](Points& points) { points.col(9).swap(points.col(16)); });
  for (const std::string line :
       {"atlas leaves.csv", "register leaves.csv", "register leaves.csv --template leaves.csv#1"})
    EXPECT_THAT(run_line(line).err,
                HasSubstr("warning: specimen 'leaf_5' (leaves.csv#5): landmarks 10 and 17 look exchanged"))
        << line;
  const ProgramRun pair = run_line("register leaves.csv#1 leaves.csv#5");
  EXPECT_THAT(pair.err, AllOf(HasSubstr("leaves.csv#5: landmarks 10 and 17 look exch"),
                              HasSubstr("; pulson audit leaves.csv#1 leaves.csv#5\n")));
  EXPECT_THAT(pair.out, HasSubstr("landmarks 10, 17 are not where the others predict them"));
  const nlohmann::json record = read_json("out/registration.json");
  EXPECT_EQ(record["prediction"]["doubted"], nlohmann::json({10, 17}));
  EXPECT_EQ(record["verdicts"].size(), 19U);
  EXPECT_GT(record["verdicts"][9]["predicted_over_sigma"], record["prediction"]["limit"]);
  EXPECT_THAT(contents("out/report.html"), HasSubstr("\"outliers\":[9,16]"));
  const ProgramRun untouched = run_line("register leaves.csv#1 leaves.csv#2");
  EXPECT_THAT(untouched.err, Not(HasSubstr("look")));
  EXPECT_THAT(untouched.out, HasSubstr("each landmark is where the others predict it"));
}

TEST_F(WrongLandmarks, OfMirroredAndRescaledSpecimensAreNamed) {
  write_leaves(2, [](Points& points) { points.row(0) *= -1; });
  EXPECT_THAT(run_line("atlas leaves.csv").err, HasSubstr("specimen 'leaf_3' (leaves.csv#3): it looks mirrored"));
  write_leaves(2, [](Points& points) { points *= 0.01; });
  EXPECT_THAT(run_line("atlas leaves.csv").err,
              AllOf(HasSubstr("specimen 'leaf_3' (leaves.csv#3): it is 0.0"), HasSubstr("another unit of length?")));
  EXPECT_THAT(run_line("register leaves.csv#1 leaves.csv#3").err, HasSubstr("another unit of length?"));
}

TEST_F(WrongLandmarks, InReverseOrderAreNamed) {
  std::ofstream forwards("a.csv"), backwards("b.csv");
  const auto point = [](int k, double bump) {
    const double t = 2 * M_PI * k / 30, r = 1 + bump * std::exp(-3 * (t - 1) * (t - 1));
    return std::to_string(80 * r * std::cos(t)) + "," + std::to_string(50 * r * std::sin(t)) + "\n";
  };
  forwards << "x,y\n";
  backwards << "x,y\n";
  for (int k = 0; k < 30; ++k) forwards << point(k, 0.5);
  for (int k = 29; k >= 0; --k) backwards << point(k, 0.4);
  forwards.close();
  backwards.close();
  const ProgramRun done = run_line("register a.csv b.csv");
  EXPECT_THAT(done.err, HasSubstr("b.csv: its landmarks look to be in reverse order"));
  EXPECT_THAT(done.out, HasSubstr("no landmark is cleared"));
}

TEST_F(WrongLandmarks, AreMatchedInCount) {
  const ProgramRun done = run_line("register " + leaves_file());
  EXPECT_THAT(done.out, HasSubstr("matched    8 of 8"));
}

TEST_F(WrongLandmarks, OfTwoSpecimensMayBeMissing) {
  const std::string first = "A,1,0,0\nA,2,10,0\nA,3,5,3\nA,4,1,1\nA,5,3,6\n";
  const std::vector<std::string> second = {"B,1,0,0.2\n", "B,2,10.5,0\n", "B,3,5,3.3\n", "B,4,1,1.3\n", "B,5,3,6.2\n"};
  for (std::size_t missing = 0; missing < 5; ++missing) {
    std::string text = "specimen,landmark,x,y\n" + first;
    for (std::size_t a = 0; a < 5; ++a) text += a == missing ? "B," + std::to_string(a + 1) + ",NA,NA\n" : second[a];
    write("two.csv", text);
    const ProgramRun done = run_line("atlas two.csv");
    EXPECT_EQ(done.exit_code, 0) << done.err;
    EXPECT_THAT(done.out, HasSubstr("predicted   1 missing landmark"));
    const nlohmann::json predicted = read_json("out/atlas.json")["specimens"][1]["predicted"][0];
    EXPECT_EQ(predicted["landmark"], missing + 1);
    EXPECT_GT(predicted["half_width_90"][0].get<double>(), 0);
  }
}

// Specimens without a landmark in common, and the first of them.
TEST_F(WrongLandmarks, OfHalvesAreAlignedByTheOthers) {
  formats::LandmarkFile file = formats::read_landmark_file(leaves_file());
  file.shapes[0].points.leftCols(9).setConstant(std::nan(""));
  file.shapes[1].points.rightCols(10).setConstant(std::nan(""));
  formats::write_landmark_file("halves.csv", file);
  const ProgramRun done = run_line("atlas halves.csv");
  EXPECT_THAT(done.exit_code, testing::AnyOf(0, 3)) << done.err;
  EXPECT_THAT(done.out, HasSubstr("predicted   19 missing landmarks"));
}

struct Slip {
  std::string line, message;
};

class SlipsOfWords : public Program, public testing::WithParamInterface<Slip> {};

TEST_P(SlipsOfWords, AreAnswered) {
  std::filesystem::copy(std::filesystem::path(PULSON_SOURCE_DIR) / "sample_shapes" / "leaves.tps", "leaves.tps");
  const ProgramRun done = run(words(GetParam().line + " -o out"));
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_THAT(done.err, HasSubstr(GetParam().message));
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, SlipsOfWords,
    testing::Values(
        Slip{"register leaves.tps#1 leaves.tps#2 --noise ch-sd", "as in ch-sd:beta=100%"},
        Slip{"register leaves.tps#1 leaves.tps#2 --noise ch-sd beta=1", "did you mean 'ch-sd:beta=1'?"},
        Slip{"register leaves.tps#1 leaves.tps#2 --noise=p-sd:beta=2 fields=grid",
             "did you mean 'p-sd:beta=2,fields=grid'?"},
        Slip{"register leaves.tps#1 leaves.tps#2 --kernel gaussian alpha=3", "did you mean 'gaussian:alpha=3'?"},
        Slip{"register leaves.tps#1 leaves.tps#2 --beta 1",
             "beta is a parameter of --noise, as in --noise ch-sd:beta=1"},
        Slip{"register leaves.tps#1 leaves.tps#2 --beta=3", "as in --noise ch-sd:beta=3"},
        Slip{"register leaves.tps#1 leaves.tps#2 --alpha 40",
             "alpha is a parameter of --kernel, as in --kernel gaussian:alpha=40"},
        Slip{"register leaves.tps#leaf_1 leaves.tps#2", "did you mean 'leaves.tps#id=leaf_1'?"},
        Slip{"register leaves.tps#1 leaves.tps#Leaf_2", "did you mean 'leaves.tps#id=leaf_2'?"},
        Slip{"register leaves.tps#1 leaves.tps#2 --noise ch-sd:beta=1 --fit beta",
             "unknown option '--fit'; a number that is fitted is marked where it stands: --noise "
             "ch-sd:beta=fit"},
        Slip{"sample leaves.tps#1 leaves.tps#2 --parameters beta=0.5", "with a prior 'fit(0.5)'"},
        Slip{"compare leaves.tps --noise ch-sd", "ch-sd:beta=fit where it is to be fitted"},
        Slip{"compare leaves.tps --noise ch-sd:beta=2:fit", "their own starting values"},
        Slip{"compare leaves.tps --noise p-sd:beta=fit,width=fit,fields=grid", "compare does not fit width"},
        Slip{"compare leaves.tps --kernel gaussian:weight=fit", "compare fits the widths alpha"},
        Slip{"compare leaves.tps --sigma fit(0.5)", "numbers have no priors here"},
        Slip{"compare leaves.tps --lambda auto", "--lambda is 'auto'; a number is needed, or fit"},
        Slip{"atlas leaves.tps --sigma auto", "--sigma is 'auto'; a number is needed, or fit"},
        Slip{"atlas leaves.tps --lambda fit(0.5)", "without a prior"},
        Slip{"compare leaves.tps --noise none,ch-sd", "repeat --noise: --noise none --noise ch-sd"},
        Slip{"compare leaves.tps --noise ch-sd:beta=1,on=2,none",
             "repeat --noise: --noise ch-sd:beta=1,on=2 --noise none"},
        Slip{"register leaves.tps#1 leaves.tps#2 --noise ch-sd:beta=1,p-sd:beta=2",
             "ch-sd:beta=1+p-sd:beta=2 joins them"}),
    [](const auto& slip) { return "Slip" + std::to_string(slip.index); });

TEST_F(WrongLandmarks, OfAnAtlasNeedNoOptionThatItLacks) {
  const ProgramRun done = run_line("atlas " + leaves_file() + " " + sample("fish_source") + " --flip-y");
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_THAT(done.err, AllOf(HasSubstr("has 19"), HasSubstr("has 68"), Not(HasSubstr("--data"))));
  EXPECT_THAT(run_line("register " + leaves_file() + "#1 " + sample("fish_source") + " --flip-y").err,
              HasSubstr("--data varifold"));
}

TEST_F(WrongLandmarks, AreNotPictures) {
  const auto image = [](const std::string& name) {
    return (std::filesystem::path(PULSON_SOURCE_DIR) / "sample_shapes" / name).string();
  };
  const std::string one = image("leaf_1.png"), two = image("leaf_2.png");
  const std::string second = std::filesystem::exists(two) ? two : one;
  EXPECT_THAT(run_line("register " + one + " " + second).err,
              AllOf(HasSubstr(one + ", " + second + " are images"), HasSubstr("docs/photographs.md")));
}

TEST_F(WrongLandmarks, OnALineOfAnotherUnitAreAligned) {
  write("mm.csv", "x\n0\n1\n2.2\n3\n4.1\n5\n");
  write("um.csv", "x\n0\n1010\n2190\n3010\n4090\n5005\n");
  const ProgramRun done = run_line("register mm.csv um.csv");
  EXPECT_THAT(done.err, AllOf(HasSubstr("--align similarity"), Not(HasSubstr("--noise"))));
}

}  // namespace
}  // namespace pulson
