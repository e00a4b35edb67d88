// Slips that users make: each is reported, and none makes a wrong result look right.

#include <gmock/gmock.h>

#include "program.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class Slips : public Program {
 protected:
  static std::string sample_file(const std::string& name) {
    return (std::filesystem::path(PULSON_SOURCE_DIR) / "sample_shapes" / name).string();
  }

  // First fields of the rows of a table.
  static std::vector<std::string> first_column(const std::string& name) {
    std::istringstream lines(contents(name));
    std::vector<std::string> fields;
    for (std::string line; std::getline(lines, line);) fields.push_back(line.substr(0, line.find(',')));
    return fields;
  }

  static void register_leaves() {
    const ProgramRun done = run({"register", sample_file("leaves.tps") + "#1", sample_file("leaves.tps") + "#2", "-o",
                                 "leaf", "--align", "similarity", "--no-picture"});
    ASSERT_EQ(done.exit_code, 0) << done.err;
  }
};

TEST_F(Slips, LandmarksKeepTheirNumbersWhereOthersAreMissing) {
  write("a.csv", "x,y\n0,0\nNA,NA\n2,0\n0,1\n2,1\n");
  write("b.csv", "x,y\n0,0\n1,0\n2,0\n0,1\n2,3\n");
  const ProgramRun done =
      run(words("register a.csv b.csv -o out --align none --lambda 10 --sigma 0.1 --kernel gaussian:alpha=1"));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.err, HasSubstr("left out: 2"));
  EXPECT_THAT(done.out, HasSubstr("at landmark 5:"));
  EXPECT_THAT(first_column("out/residuals.csv"), ElementsAre("landmark", "1", "3", "4", "5"));
  EXPECT_THAT(contents("out/trajectory.csv"), HasSubstr("\n0,0,5,2,1,"));
  EXPECT_THAT(contents("out/report.html"), HasSubstr("<td class=\"number\">5</td>"));
  EXPECT_THAT(contents("out/report.html"), Not(HasSubstr("<td class=\"number\">2</td><td class=\"number\">")));
  EXPECT_THAT(contents("out/registration.json"), HasSubstr("\"numbers\""));
}

TEST_F(Slips, NegativesMayStandForMissingLandmarks) {
  write("a.csv", "0,0\n-1,-1\n2,0\n0,1\n2,1\n");
  write("b.csv", "0,0\n1,0\n2,0\n0,1\n2,3\n");
  const std::string common = " --lambda 10 --sigma 0.1 --kernel gaussian:alpha=1 --no-picture -o ";
  const ProgramRun asked = run(words("register a.csv b.csv --missing negative" + common + "asked"));
  EXPECT_THAT(asked.err, HasSubstr("left out: 2"));
  EXPECT_THAT(asked.err, Not(HasSubstr("--missing negative")));
  EXPECT_THAT(run(words("register a.csv b.csv" + common + "plain")).err,
              HasSubstr("--missing negative distinguishes them"));
  const ProgramRun compared = run(words(
      "compare b.csv a.csv --noise none --noise ch-sd:beta=0.1 --no-maps --missing negative" + common + "compared"));
  EXPECT_NE(compared.exit_code, 2) << compared.err;
  EXPECT_THAT(compared.err, Not(HasSubstr("--missing negative")));
}

TEST_F(Slips, LabelsTellWhichLandmarksBelongTogether) {
  write("a.csv", "label,x,y\nnose,0,0\nchin,3,0\near,3,1\nbrow,1,2\njaw,0,4\n");
  write("b.csv", "label,x,y\nnose,0,0\njaw,0,4.1\nbrow,1,2\near,3,1\nchin,3,0\n");
  const ProgramRun done = run(words("register a.csv b.csv -o out --no-picture --sigma 0.1"));
  EXPECT_THAT(done.err, HasSubstr("note: b.csv: its landmarks are in a different order"));
  EXPECT_THAT(done.err, Not(HasSubstr("mirrored")));
  EXPECT_LE(read_json("out/registration.json")["max_residual"], 0.11);
  const ProgramRun compared =
      run(words("compare a.csv b.csv -o c --no-picture --no-maps --noise none --noise ch-sd:beta=0.1"));
  EXPECT_THAT(compared.err, HasSubstr("note: b.csv: its landmarks are in a different order"));
}

TEST_F(Slips, MirroredShapesAreTold) {
  write("up.csv", "0,0\n3,0\n3,1\n1,2\n0,4\n");
  write("down.csv", "0,0\n3,0\n3,-1\n1,-2\n0,-4\n");
  const Arguments common = words("-o out --no-picture --sigma 0.1");
  using testing::AllOf;
  EXPECT_THAT(
      run(joined(words("register up.csv down.csv"), common)).err,
      AllOf(HasSubstr("note: the shapes look mirrored"), HasSubstr("use pulson convert --flip-y, else --reflect\n")));
  EXPECT_THAT(run(joined(words("register up.csv down.csv --align rigid --reflect"), common)).err,
              Not(HasSubstr("mirrored")));
  EXPECT_THAT(run(joined(words("register up.csv up.csv"), common)).err, Not(HasSubstr("mirrored")));
  EXPECT_THAT(run({"register", sample("fish_source"), sample("fish_target"), "-o", "out", "--no-picture"}).err,
              Not(HasSubstr("mirrored")));
}

TEST_F(Slips, LandmarksOutsideTheImageAreTold) {
  register_leaves();
  const std::string image = sample_file("leaf_1.png");
  const ProgramRun right = run({"warp", "leaf/registration.json", image, "-o", "right.png"});
  EXPECT_EQ(right.exit_code, 0) << right.err;
  EXPECT_THAT(right.err, Not(HasSubstr("outside")));
  const ProgramRun wrong = run({"warp", "leaf/registration.json", image, "-o", "wrong.png", "--pixel-size", "0.1"});
  EXPECT_EQ(wrong.exit_code, 0) << wrong.err;
  EXPECT_THAT(wrong.err, HasSubstr("warning: 19 of 19 landmarks of "));
}

TEST_F(Slips, NothingThatIsReadIsReplaced) {
  register_leaves();
  std::filesystem::copy(sample_file("leaf_1.png"), "leaf.png");
  write("points.csv", "x,y\n10,20\n");
  const auto before = all_files();
  for (const char* line : {"warp leaf leaf.png -o leaf.png", "warp leaf leaf.png -o new.png --jacobian ./leaf.png",
                           "warp leaf points.csv -o points.csv",
                           "warp leaf/registration.json leaf.png -o new.png --json leaf/registration.json"}) {
    const ProgramRun done = run(words(line));
    EXPECT_EQ(done.exit_code, 2) << line;
    EXPECT_THAT(done.err, HasSubstr("which is an input")) << line;
  }
  EXPECT_TRUE(changed_since(before).empty());
}

TEST_F(Slips, OptionsOfImagesAreNotIgnoredForPoints) {
  register_leaves();
  write("points.csv", "x,y\n10,20\n");
  for (const char* option : {"--pixel-size 2", "--origin 1,2", "--size 10x10"})
    EXPECT_THAT(run(words(std::string("warp leaf points.csv -o moved.csv ") + option)).err,
                HasSubstr("is for images, and points.csv holds landmarks"));
  EXPECT_THAT(run({"warp", sample_file("leaf_1.png"), "leaf", "-o", "x.png"}).err,
              HasSubstr("the registration comes first"));
}

TEST_F(Slips, EqualShapesNeedNoSearch) {
  const std::string leaf = sample_file("leaves.tps") + "#1";
  const ProgramRun done = run({"register", leaf, leaf, "-o", "same", "--align", "similarity", "--no-picture"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  const nlohmann::json record = read_json("same/registration.json");
  EXPECT_LE(record["iterations"], 3);
  EXPECT_LE(record["rms"], 1e-9);
}

TEST_F(Slips, TheFolderOfARegistrationStandsForIt) {
  register_leaves();
  const ProgramRun done = run({"warp", "leaf", sample_file("leaves.tps") + "#1", "-o", "moved.csv"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(first_column("moved.csv").size(), 21U) << "a line that says that y points up, a header, 19 landmarks";
}

// Jacobians of points count the alignment, as those of images do.
TEST_F(Slips, JacobiansCountTheAlignment) {
  write("a.csv", "0,0\n1,0\n1,1\n0,1\n");
  write("b.csv", "0,0\n2,0\n2,2\n0,2\n");
  ASSERT_EQ(run(words("register a.csv b.csv --align similarity -o out --no-picture")).exit_code, 0);
  for (const std::string direction : {"", " --inverse"}) {
    ASSERT_EQ(run(words("warp out b.csv -o c.csv --json c.json" + direction)).exit_code, 0);
    EXPECT_NEAR(read_json("c.json")["min_jacobian"].get<double>(), 4, 1e-3) << direction;
  }
}

TEST_F(Slips, ImagesAreNoLandmarksAndNoRegistrations) {
  const std::string image = sample_file("leaf_1.png");
  EXPECT_EQ(
      run({"info", image}).err,
      "pulson: " + image + " is an image (png); landmarks are needed, which docs/photographs.md says how to place\n");
  const ProgramRun swapped = run({"warp", image, "leaf/registration.json", "-o", "out.csv"});
  EXPECT_EQ(swapped.exit_code, 2);
  EXPECT_THAT(swapped.err, HasSubstr("is an image; the registration comes first"));
}

TEST_F(Slips, ARunThatFailsLeavesNoFolder) {
  write("a.csv", "0,0\n1,0\n1,1\n");
  for (const std::string wrong : {"--sigma 0", "--kernel gausian", "--steps 0"}) {
    EXPECT_EQ(run(words("register a.csv a.csv -o new/out " + wrong)).exit_code, 2);
    EXPECT_FALSE(std::filesystem::exists("new")) << wrong;
  }
  std::filesystem::create_directory("mine");
  EXPECT_EQ(run(words("register a.csv a.csv -o mine --sigma 0")).exit_code, 2);
  EXPECT_TRUE(std::filesystem::exists("mine"));
}

TEST_F(Slips, WordsOfTheParserAreOurs) {
  write("a.csv", "0,0\n1,0\n1,1\n");
  EXPECT_THAT(run(words("register a.csv a.csv -o out --sigma half")).err,
              HasSubstr("--sigma is 'half'; a number is needed"));
  EXPECT_THAT(run(words("warp out 1 2 -o new")).err, HasSubstr("'2' is one argument too many"));
  EXPECT_THAT(run(words("warp out 1 2 3 -o new")).err, HasSubstr("arguments too many: "));
  EXPECT_THAT(run(words("register a.tps b.tps")).err, HasSubstr("--out is required: -o FOLDER"));
}

}  // namespace
}  // namespace pulson
