// `pulson register` with the image of the source: below the landmarks of its pictures.

#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "program.hpp"
#include "pulson/images/image.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;

class RegisterImage : public Program {
 protected:
  static constexpr int kSide = 60;

  // The upper half is red, the lower one blue.
  static void write_photo() {
    images::Image image(kSide, kSide, 3, images::PixelType::kUint8);
    for (std::size_t i = 0; i < image.pixel_count(); ++i)
      image.values<std::uint8_t>()[3 * i + (i < image.pixel_count() / 2 ? 0 : 2)] = 250;
    write_image("photo.png", image);
  }

  void SetUp() override {
    Program::SetUp();
    write_photo();
    const std::string corners = "LM=4\n5 5\n55 5\n55 55\n5 55\n";
    write("square.tps", corners + "IMAGE=C:\\photos\\photo.png\nID=a\n" + corners + "ID=b\n");
    write("a.csv", "x,y\n5,5\n55,5\n55,55\n5,55\n");
  }

  static std::set<std::string> files_in(const std::string& folder) {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(folder))
      names.insert(entry.path().filename().string());
    return names;
  }

  static void expect_done(const std::string& line) {
    const ProgramRun done = run(words(line));
    ASSERT_EQ(done.exit_code, 0) << done.err;
    EXPECT_THAT(done.err, Not(HasSubstr("not drawn")));
  }

  // Of the first panel of the picture: the mean of blue minus red, above and below its middle.
  static std::vector<double> blueness() {
    const images::Image picture = images::read_image("out/registration.png");
    std::vector<double> means;
    for (const int part : {1, 3}) {
      double sum = 0;
      for (int i = 0; i < 20; ++i) {
        const int x = picture.width() / 4 + 7 * i, y = picture.height() * (3 + 2 * part) / 16 + i;
        sum += picture.at(x, y, 2) - picture.at(x, y, 0);
      }
      means.push_back(sum / 20);
    }
    return means;
  }

  static void expect_red_above_blue() {
    EXPECT_LT(blueness()[0], -20);
    EXPECT_GT(blueness()[1], 20);
  }
};

TEST_F(RegisterImage, OfATpsIsFoundBesideItAndShown) {
  expect_done("register square.tps#1 square.tps#2 -o out");
  EXPECT_THAT(files_in("out"), ElementsAre("registration.json", "registration.png", "registration.svg", "report.html",
                                           "residuals.csv", "trajectory.csv"));
  expect_red_above_blue();
  EXPECT_THAT(contents("out/registration.svg"), HasSubstr("<image"));
  EXPECT_THAT(contents("out/report.html"),
              AllOf(HasSubstr("src=\"data:image/jpeg;base64,"), HasSubstr("\"image\":["), HasSubstr("\"down\":false")));
}

TEST_F(RegisterImage, MakesRowsOfLandmarksThatAreNotOfTps) {
  expect_done("register a.csv a.csv -o out --image photo.png");
  expect_red_above_blue();
  EXPECT_THAT(contents("out/report.html"), HasSubstr("\"down\":true"));
  EXPECT_TRUE(read_json("out/registration.json")["frame"]["y_down"]);
  expect_done("register a.csv a.csv -o out --image photo.png --flip-y");
  expect_red_above_blue();
  EXPECT_THAT(contents("out/report.html"), HasSubstr("\"down\":false"));
}

TEST_F(RegisterImage, IsOfTheSizeThatIsGiven) {
  write("large.csv", "x,y\n50,50\n550,50\n550,550\n50,550\n");
  expect_done("register large.csv large.csv -o out --image photo.png --pixel-size 10");
  expect_red_above_blue();
  const ProgramRun small = run(words("register large.csv large.csv -o out --image photo.png"));
  EXPECT_EQ(small.exit_code, 0);
  EXPECT_THAT(small.err,
              HasSubstr("it is not drawn below the landmarks: 3 of 4 landmarks of large.csv lie outside photo.png"));
}

TEST_F(RegisterImage, LiesWhereItsOriginIs) {
  write("far.csv", "x,y\n1005,-1995\n1055,-1995\n1055,-1945\n1005,-1945\n");
  expect_done("register far.csv far.csv -o out --image photo.png --origin=1000,-2000");
  expect_red_above_blue();
  const ProgramRun wrong = run(words("register far.csv far.csv -o out --image photo.png --origin 1000"));
  EXPECT_EQ(wrong.exit_code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("--origin is '1000'; it must be two numbers"));
}

TEST_F(RegisterImage, ThatIsNoneIsNotedOrRefused) {
  write("word.png", "hello");
  const ProgramRun done = run(words("register a.csv a.csv -o out --image word.png"));
  EXPECT_EQ(done.exit_code, 0);
  EXPECT_THAT(done.err, HasSubstr("note: word.png: it is not drawn below the landmarks: "));
  EXPECT_EQ(files_in("out").size(), 6U);
  const ProgramRun missing = run(words("register a.csv a.csv -o out --image missing.png"));
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.err, HasSubstr("missing.png"));
  EXPECT_EQ(run(words("register a.csv a.csv -o out --image photo.png --pixel-size 0")).exit_code, 2);
  write("space.csv", "x,y,z\n0,0,0\n1,0,0\n0,1,0\n0,0,1\n");
  const ProgramRun space = run(words("register space.csv space.csv -o out --image photo.png"));
  EXPECT_EQ(space.exit_code, 2);
  EXPECT_THAT(space.err, HasSubstr("--image needs landmarks in 2D"));
}

// ---- names in data

class HostileImageName : public RegisterImage, public testing::WithParamInterface<std::string> {};

// A name in a file is the name of an image, whatever it looks like: nothing is run and no file is touched, and the
// numbers are those without it.
TEST_P(HostileImageName, IsOnlyEverTheNameOfAnImage) {
  const std::string corners = "LM=4\n5 5\n55 5\n55 55\n5 55\n";
  write("e.toml", "side-by-side = \"<touch pwned;#/s.png\"\njson = \"victim\"\nout = \"victim\"\n");
  write("victim", "mine");
  std::filesystem::create_directories("data/below");
  for (const std::string folder : {"data/", "data/below/"}) {
    write(folder + "--config=e.toml", "");
    std::filesystem::copy_file("e.toml", folder + "e.toml");
    for (const char* name : {"-o", "|touch pwned", "<touch pwned;#", "$(touch pwned)", "a\nb"})
      std::filesystem::copy_file("photo.png", folder + name);
  }
  write("data/plain.tps", corners + "ID=a\n" + corners + "ID=b\n");
  write("data/named.tps", corners + "IMAGE=" + GetParam() + "\nID=a\n" + corners + "ID=b\n");
  expect_done("register data/plain.tps#1 data/plain.tps#2 -o plain --no-picture -q");
  const auto before = all_files();
  const ProgramRun done = run(words("register data/named.tps#1 data/named.tps#2 -o out"));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  for (const std::string& name : changed_since(before)) EXPECT_THAT(name, testing::StartsWith("./out/"));
  EXPECT_EQ(files_in("out").size(), 6U);
  EXPECT_EQ(read_json("out/registration.json")["cost"], read_json("plain/registration.json")["cost"]);
  EXPECT_EQ(contents("out/trajectory.csv"), contents("plain/trajectory.csv"));
}

INSTANTIATE_TEST_SUITE_P(Register, HostileImageName,
                         testing::Values("--config=e.toml", "-o", "|touch pwned", "<touch pwned;#", "$(touch pwned)",
                                         "../../victim", "../victim", "/dev/zero", "/dev/stdin", "below", "..", ".",
                                         "below/--config=e.toml", "below/-o", std::string(300, 'a'),
                                         std::string(5000, '/')));

// Only what lies in the folder of the file, or is named from there, is shown.
TEST_F(RegisterImage, IsNamedFromTheFolderOfTheFile) {
  const std::string corners = "LM=4\n5 5\n55 5\n55 55\n5 55\n";
  std::filesystem::create_directories("data/below");
  std::filesystem::copy_file("photo.png", "data/below/p.png");
  const auto is_shown = [&](const std::string& name) {
    write("data/a.tps", corners + "IMAGE=" + name + "\nID=a\n" + corners + "ID=b\n");
    expect_done("register data/a.tps#1 data/a.tps#2 -o out");
    return contents("out/report.html").find("data:image/jpeg") != std::string::npos;
  };
  EXPECT_TRUE(is_shown("below/p.png"));
  EXPECT_TRUE(is_shown("below\\p.png"));
  EXPECT_TRUE(is_shown("../photo.png"));
  EXPECT_FALSE(is_shown("p.png"));
  EXPECT_FALSE(is_shown(std::filesystem::absolute("photo.png").string()));
  std::filesystem::copy_file("photo.png", "data/photo.png");
  EXPECT_TRUE(is_shown(std::filesystem::absolute("photo.png").string()));
  EXPECT_TRUE(is_shown("C:\\photos\\photo.png"));
}

// One program alone runs: it has no children but those that draw.
TEST_F(RegisterImage, IsWarpedWithoutAnotherProcess) {
  expect_done("register a.csv a.csv -o out --image photo.png --no-picture");
  EXPECT_THAT(contents("out/report.html"), HasSubstr("data:image/jpeg"));
  std::filesystem::create_directory("nothing");
  const ProgramRun alone = run(words("register a.csv a.csv -o alone --image photo.png --no-picture"),
                               {.search_path = std::filesystem::absolute("nothing").string()});
  EXPECT_EQ(alone.exit_code, 0) << alone.err;
  EXPECT_THAT(contents("alone/report.html"), HasSubstr("data:image/jpeg"));
}

TEST_F(RegisterImage, MayHaveNoMorePixelsThanAllowed) {
  write("a.png", "");
  const ProgramRun small = run(words("register a.csv a.csv -o out --image photo.png --max-pixels 3599 --no-picture"));
  EXPECT_EQ(small.exit_code, 0);
  EXPECT_THAT(small.err, HasSubstr("note: photo.png: it is not drawn below the landmarks: cannot read 'photo.png': the "
                                   "image has 60 x 60 pixels, more than --max-pixels 3599 allows"));
  expect_done("register a.csv a.csv -o out --image photo.png --max-pixels 3600 --no-picture");
  for (const char* count : {"0", "-1", "1.5", "nan", "1e12"}) {
    const ProgramRun wrong =
        run(words(std::string("register a.csv a.csv -o out --image photo.png --max-pixels=") + count));
    EXPECT_EQ(wrong.exit_code, 2) << count;
    EXPECT_THAT(wrong.err, HasSubstr("--max-pixels is ")) << count;
  }
}

TEST_F(RegisterImage, IsAFile) {
  for (const char* image : {"/dev/zero", "/dev/null", "."}) {
    const ProgramRun refused = run(words(std::string("register a.csv a.csv -o out --image ") + image));
    EXPECT_EQ(refused.exit_code, 2) << image;
    EXPECT_THAT(refused.err, testing::StartsWith("pulson: cannot read '" + std::string(image) + "': it is a "));
    EXPECT_EQ(count_lines(refused.err), 1U);
  }
}

}  // namespace
}  // namespace pulson
