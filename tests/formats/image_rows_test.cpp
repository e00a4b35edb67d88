// Which files count y downwards, in rows of an image.

#include <string>

#include <gtest/gtest.h>

#include "reading_files.hpp"

namespace pulson::formats {
namespace {

class ImageRows : public ReadingFiles {
 protected:
  static bool is_down(const std::string& name, const std::string& text, const ReadOptions& options = {}) {
    write(name, text);
    return read_landmark_file(name, options).shapes.front().frame.y_down;
  }
};

constexpr const char* kTps = "LM=1\n1 2\nIMAGE=a.jpg\nID=a\n";

TEST_F(ImageRows, AreOfFormatsForImages) {
  EXPECT_TRUE(is_down("a.pts", "version: 1\nn_points: 1\n{\n1 2\n}\n"));
  EXPECT_TRUE(is_down("a.ljson", R"({"labels": [], "landmarks": {"points": [[1, 2]]}, "version": 2})"));
  EXPECT_TRUE(is_down("a.json",
                      R"({"version": "5", "shapes": [{"label": "a", "points": [[1, 2]], "shape_type": "point"}],
                          "imagePath": "a.jpg", "imageData": null})"));
  EXPECT_TRUE(is_down("a.xml",
                      "<dataset><images><image file='a.jpg'><box><part name='0' x='1' y='2'/></box></image>"
                      "</images></dataset>"));
  EXPECT_TRUE(
      is_down("a.txt",
              "<shapes type=list>\n<landmarks.pixel type=matrix rownames=TRUE >\n\ttip\t1\t2\n</landmarks.pixel>\n"
              "</shapes>\n"));
  EXPECT_TRUE(is_down("a.csv", "scorer,n,n\nbodyparts,a,a\ncoords,x,y\na.png,1,2\n"));
  EXPECT_TRUE(is_down("a.csv", "\"Pt-0\",\"true\",\"1.5\",\"2\",\"3\",\"4\"\n"));
  EXPECT_TRUE(is_down("a.txt", "point\n1\n1 2\n"));
}

TEST_F(ImageRows, AreOfTablesThatNameImagesOrPixels) {
  EXPECT_TRUE(is_down("a.csv", "image,landmark,x,y\na.png,1,1,2\na.png,2,3,4\n"));
  EXPECT_TRUE(is_down("a.csv", "x_px,y_px\n1,2\n3,4\n"));
  EXPECT_TRUE(is_down("a.csv", "x,y\n1,2\n3,4\n")) << "as of any file that does not say";
  EXPECT_FALSE(is_down("a.csv", "# frame: y=up\nx,y\n1,2\n3,4\n"));
}

TEST_F(ImageRows, AreNotOfTpsWhoseYPointsUp) { EXPECT_FALSE(is_down("a.tps", kTps)); }

TEST_F(ImageRows, AreOfThePlaneAlone) {
  EXPECT_FALSE(is_down("a.txt", "point\n1\n1 2 3\n"));
  EXPECT_FALSE(is_down("a.csv", "x\n1\n2\n", {.y_down = true}));
}

TEST_F(ImageRows, AreWhatAReaderSays) {
  EXPECT_TRUE(is_down("a.tps", kTps, {.y_down = true}));
  EXPECT_FALSE(is_down("a.pts", "version: 1\nn_points: 1\n{\n1 2\n}\n", {.y_down = false}));
}

TEST_F(ImageRows, AreKeptByJson) {
  LandmarkFile file;
  Landmarks& shape = file.shapes.emplace_back();
  shape.points = points_2d({1, 2});
  for (const bool y_down : {true, false}) {
    shape.frame.y_down = y_down;
    shape.frame.says_y = true;
    write_landmark_file("kept.json", file);
    EXPECT_EQ(read_landmarks("kept.json").frame.y_down, y_down);
  }
  EXPECT_EQ(read_error("bad.json", R"({"points": [[1, 2]], "y_down": 1})"),
            "bad.json: 'y_down' is neither true nor false");
}

}  // namespace
}  // namespace pulson::formats
