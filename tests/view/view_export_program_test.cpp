// What `pulson view` exports, also of sessions that are opened again.

#include <filesystem>
#include <map>
#include <set>

#include <fmt/format.h>
#include <gmock/gmock.h>

#include "pulson/formats/landmark_files.hpp"
#include "pulson/images/image.hpp"
#include "pulson/images/pages.hpp"
#include "view_program.hpp"

namespace pulson {
namespace {

TEST_F(ViewProgram, ExportsWhatWasPlacedInRowsOfThePicture) {
  Server server({"leaf_1.png", "leaf_2.png"});
  server.save(
      placed(server.document(), {{json::array({10, 20}), json::array({30.5, 40})}, {json::array({1, 2}), "missing"}}));
  const auto [status, reply] = server.post("export", {{"name", "out.csv"}});
  EXPECT_EQ(status, 200) << reply;
  const formats::LandmarkFile read = formats::read_landmark_file("out.csv");
  ASSERT_EQ(read.shapes.size(), 2U);
  EXPECT_EQ(read.shapes[0].points, (Points{{10, 30.5}, {20, 40}}));
  EXPECT_TRUE(std::isnan(read.shapes[1].points(0, 1)));
  // In tps y counts up from the lower edge of 400 rows; pulson's convention for it is that of Frame.
  EXPECT_EQ(server.post("export", {{"name", "out.tps"}}).first, 200);
  const Landmarks up = formats::read_landmark_file("out.tps").shapes[0];
  EXPECT_FALSE(up.frame.y_down);
  EXPECT_EQ(up.points(1, 0), 400 - 20);
  EXPECT_EQ(up.image, "leaf_1.png");
}

TEST_F(ViewProgram, OpenedShapesComeBackAsTheyWere) {
  const formats::LandmarkFile before = formats::read_landmark_file("leaves.tps");
  Server server({"leaves.tps"});
  EXPECT_EQ(server.document()["specimens"].size(), before.shapes.size());
  EXPECT_EQ(server.document()["specimens"][0]["picture"], "leaf_1.png");
  EXPECT_EQ(server.post("export", {{"name", "leaves.tps"}}).first, 422) << "without --in-place";
  EXPECT_EQ(server.post("export", {{"name", "leaf_1.png"}}).first, 422);
  EXPECT_EQ(server.post("export", {{"name", "../x.tps"}}).first, 422);
  const auto [status, reply] = server.post("export", {{"name", "copy.tps"}});
  EXPECT_EQ(status, 200) << reply;
  const formats::LandmarkFile after = formats::read_landmark_file("copy.tps");
  ASSERT_EQ(after.shapes.size(), before.shapes.size());
  for (std::size_t i = 0; i < before.shapes.size(); ++i) {
    EXPECT_LT((after.shapes[i].points - before.shapes[i].points).cwiseAbs().maxCoeff(), 1e-9);
    EXPECT_EQ(after.shapes[i].scale, before.shapes[i].scale);
    EXPECT_EQ(after.shapes[i].name, before.shapes[i].name);
  }
}

// What is exported after the session alone was opened again, without the landmark file, is what was before: in every
// format that is written, for files that say their picture, frame and scale themselves and for those that do not.
TEST_F(ViewProgram, ASessionThatIsOpenedAgainExportsTheSame) {
  write("plain.csv", "x,y\n10,20.1\n50,60\n90,30\n");
  write("alone.tps", "LM=3\n10 20\n50 60\n90 30\nIMAGE=elsewhere.jpg\nID=one\nCOMMENT=old\nSCALE=0.01\n");
  std::filesystem::copy("leaves.tps", "pair.tps");
  std::filesystem::copy("alone.tps", "named.tps");
  const std::vector<std::vector<std::string>> sessions = {{"leaves.tps"},
                                                          {"plain.csv", "leaf_1.png", "--flip-y"},
                                                          {"named.tps", "leaf_2.png"},
                                                          {"alone.tps"},
                                                          {"pair.tps", "--scale", "apply"}};
  std::set<std::string> written;
  const auto exported = [&](Server& server, const std::string& stem) {
    std::map<std::string, std::string> files;
    for (const formats::LandmarkFormat& format : formats::landmark_formats())
      if (format.write != nullptr) {
        const std::string name = stem + "." + format.extensions[0];
        const auto [status, reply] = server.post("export", {{"name", name}});
        files[format.name] = status == 200 ? contents(name) : reply["error"].get<std::string>();
        if (status == 200) written.insert(format.name);
        std::filesystem::remove(name);
      }
    return files;
  };
  for (const std::vector<std::string>& session : sessions) {
    const std::string stem = std::filesystem::path(session[0]).stem().string();
    std::map<std::string, std::string> before;
    {
      Server server(session);
      json document = server.document();
      document["specimens"][0]["points"][0] = json::array({5, 7});
      EXPECT_EQ(server.save(document), 200);
      before = exported(server, "out");
    }
    std::filesystem::remove(session[0]);
    Server again({stem + ".pulson.json"});
    EXPECT_EQ(exported(again, "out"), before) << stem;
  }
  // Those that hold one shape are written of one, bigwarp of none of these.
  EXPECT_THAT(written, testing::ElementsAre("csv", "elastix", "fcsv", "ibug", "json", "mrk.json", "npy", "tps", "vtk"));
}

TEST_F(ViewProgram, LandmarksThatWereNotMovedAreExportedAsTheirFileHasThem) {
  Server server({"leaves.tps"});
  EXPECT_EQ(server.post("export", {{"name", "copy.tps"}}).first, 200);
  const auto before = formats::read_landmark_file("leaves.tps").shapes,
             after = formats::read_landmark_file("copy.tps").shapes;
  for (std::size_t i = 0; i < before.size(); ++i) {
    EXPECT_EQ(after[i].points, before[i].points);
    EXPECT_EQ(after[i].frame.y_down, before[i].frame.y_down);
    EXPECT_EQ(after[i].frame.unit_per_pixel, before[i].frame.unit_per_pixel) << "also without a picture";
  }
}

TEST_F(ViewProgram, FilesAreAddedToASessionOnce) {
  write("more.csv", "x,y\n10,20\n50,60\n");
  const std::vector<std::size_t> specimens = {8, 9, 9};
  const std::vector<std::vector<std::string>> lines = {
      {"leaves.tps"}, {"leaves.tps", "more.csv"}, {"leaves.tps", "more.csv", "leaf_1.png"}};
  for (std::size_t i = 0; i < lines.size(); ++i) {
    Server server(lines[i]);
    const json document = server.document();
    EXPECT_EQ(document["specimens"].size(), specimens[i]);
    EXPECT_FALSE(document.contains("shapes")) << "the page has no use for them";
    EXPECT_EQ(server.save(document), 200);
  }
}

// A light square in rows as they are stored, and its centre as a landmark, of each orientation of EXIF: the landmark is
// where the page shows the square, and comes back where it was.
TEST_F(ViewProgram, LandmarksStayOnTurnedPictures) {
  constexpr int kWide = 90, kHigh = 60;
  images::Page page{images::Image(kWide, kHigh, 1, images::PixelType::kUint8), {}};
  for (int y = 10; y < 18; ++y)
    for (int x = 16; x < 24; ++x) page.image.values<std::uint8_t>()[static_cast<std::size_t>(y * kWide + x)] = 255;
  for (int orientation = 1; orientation <= 8; ++orientation) {
    const std::string name = fmt::format("turned_{}", orientation);
    page.about.orientation = orientation;
    images::write_pages(name + ".tif", std::vector{page});
    write(name + ".csv", "x,y\n19.5,13.5\n50,30\n");
    Server server({name + ".csv", name + ".tif"});
    const json specimen = server.document()["specimens"][0];
    const images::Image shown = images::decode_image(server.reply_of("picture?name=0")->body);
    EXPECT_EQ(json::array({shown.width(), shown.height()}), json::array({specimen["width"], specimen["height"]}));
    Eigen::Vector2d centre(0, 0);
    double sum = 0;
    for (int y = 0; y < shown.height(); ++y)
      for (int x = 0; x < shown.width(); ++x)
        if (const double light = shown.at(x, y, 0); light > 60) centre += light * Eigen::Vector2d(x, y), sum += light;
    centre /= sum;
    // The page's picture is a jpg, whose edges are not quite symmetric.
    EXPECT_NEAR(centre.x(), specimen["points"][0][0], 0.3) << orientation;
    EXPECT_NEAR(centre.y(), specimen["points"][0][1], 0.3) << orientation;
    EXPECT_EQ(server.post("export", {{"name", name + "_back.csv"}}).first, 200);
    const Points back = formats::read_landmark_file(name + "_back.csv").shapes[0].points;
    EXPECT_LT((back - Points{{19.5, 50}, {13.5, 30}}).cwiseAbs().maxCoeff(), 1e-9) << orientation;
  }
}

TEST_F(ViewProgram, InPlaceKeepsTheFirstState) {
  const std::string first = contents("leaves.tps");
  Server server({"leaves.tps", "--in-place"});
  json document = server.document();
  document["specimens"][0]["points"][0] = json::array({5, 5});
  EXPECT_EQ(server.save(document), 200);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(server.post("export", {{"name", "leaves.tps"}}).first, 200);
  EXPECT_EQ(contents("leaves.first.tps"), first);
  EXPECT_NE(contents("leaves.tps"), first);
}

}  // namespace
}  // namespace pulson
