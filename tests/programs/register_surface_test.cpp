// `pulson register` with the surface on which the landmarks of the source lie.

#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "program.hpp"
#include "pulson/images/image.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class RegisterSurface : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("skull.csv", "x,y,z\n0,0,0\n2,0,0\n2,3,0\n0,3,0\n1,1,4\n");
    write("other.csv", "x,y,z\n0,0,0\n2,0,0\n2.2,3,0\n0,3,0.2\n1,1.3,4\n");
    write("pyramid.obj", kPyramid);
  }

  // The numbers of the motion of the page.
  static nlohmann::json motion() {
    const std::string page = contents("out/report.html");
    constexpr std::string_view kBefore = "<script type=\"application/json\">";
    const std::size_t begin = page.find(kBefore) + kBefore.size();
    return nlohmann::json::parse(page.substr(begin, page.find("</script>", begin) - begin));
  }

  static constexpr const char* kPyramid =
      "v 0 0 0\nv 2 0 0\nv 2 3 0\nv 0 3 0\nv 1 1 4\nf 1 2 3 4\nf 1 2 5\nf 2 3 5\nf 3 4 5\nf 4 1 5\n";
};

// Vertices that are landmarks move as these do.
TEST_F(RegisterSurface, MovesWithTheLandmarks) {
  const ProgramRun done = run(words("register skull.csv other.csv -o out --mesh pyramid.obj"));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(done.err, "");
  const nlohmann::json numbers = motion();
  EXPECT_EQ(numbers["triangles"].size(), 18U);
  const auto first = numbers["frames"].front().get<std::vector<double>>(),
             last = numbers["frames"].back().get<std::vector<double>>();
  const auto before = numbers["surface"].front().get<std::vector<double>>(),
             after = numbers["surface"].back().get<std::vector<double>>();
  EXPECT_EQ(numbers["surfaceTimes"].front(), numbers["times"].front());
  EXPECT_EQ(numbers["surfaceTimes"].back(), numbers["times"].back());
  EXPECT_EQ(before, first);
  ASSERT_EQ(after.size(), last.size());
  for (std::size_t i = 0; i < last.size(); ++i) EXPECT_NEAR(after[i], last[i], 1);  // places are rounded to whole units
  EXPECT_NE(after, before);
}

TEST_F(RegisterSurface, IsFoundBesideItsLandmarks) {
  ASSERT_EQ(run(words("register skull.csv other.csv -o out")).exit_code, 0);
  EXPECT_EQ(motion()["triangles"].size(), 0U);
  const images::Image without = images::read_image("out/registration.png");
  write("skull.obj", kPyramid);
  ASSERT_EQ(run(words("register skull.csv other.csv -o out")).exit_code, 0);
  EXPECT_EQ(motion()["triangles"].size(), 18U);
  const images::Image with = images::read_image("out/registration.png");
  // Greys of a shaded surface, which are some 0.6 to 0.97 of white, on paper that was white.
  const auto greys = [](const images::Image& image) {
    std::size_t count = 0;
    const auto& bytes = image.values<std::uint8_t>();
    const auto channels = static_cast<std::size_t>(image.channels());
    for (std::size_t i = 0; i < image.pixel_count(); ++i) {
      const int red = bytes[channels * i], green = bytes[channels * i + 1];
      count += red >= 140 && red < 246 && green - red >= 0 && green - red <= 4 ? 1 : 0;
    }
    return static_cast<double>(count) / static_cast<double>(image.pixel_count());
  };
  EXPECT_LT(greys(without), 0.05);
  EXPECT_GT(greys(with), greys(without) + 0.1);
}

TEST_F(RegisterSurface, ThatDoesNotFitIsNotedOrRefused) {
  write("skull.obj", "v 0 0 0\n");
  const ProgramRun broken = run(words("register skull.csv other.csv -o out"));
  EXPECT_EQ(broken.exit_code, 0);
  EXPECT_THAT(broken.err, HasSubstr("note: skull.obj: it has no triangles; a surface has some; it is not drawn"));
  const ProgramRun given = run(words("register skull.csv other.csv -o new --mesh skull.obj"));
  EXPECT_EQ(given.exit_code, 2);
  EXPECT_FALSE(std::filesystem::exists("new"));
  write("far.obj", "v 90 0 0\nv 92 0 0\nv 92 3 0\nf 1 2 3\n");
  const ProgramRun far = run(words("register skull.csv other.csv -o out --mesh far.obj"));
  EXPECT_EQ(far.exit_code, 0);
  EXPECT_THAT(far.err, HasSubstr("note: far.obj: it lies elsewhere than the landmarks"));
  write("flat.csv", "x,y\n0,0\n1,0\n0,1\n");
  const ProgramRun flat = run(words("register flat.csv flat.csv -o new --mesh pyramid.obj"));
  EXPECT_EQ(flat.exit_code, 2);
  EXPECT_THAT(flat.err, AllOf(HasSubstr("--mesh needs landmarks in 3D"), Not(HasSubstr("note"))));
}

}  // namespace
}  // namespace pulson
