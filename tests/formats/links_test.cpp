// Links of wireframes: files that have them, and tables of them.

#include <string>
#include <vector>

#include <gmock/gmock.h>

#include "error_of.hpp"
#include "numbers.hpp"
#include "reading_files.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Pair;

class Links : public ReadingFiles {
 protected:
  using Pairs = std::vector<std::pair<int, int>>;

  void SetUp() override {
    ReadingFiles::SetUp();
    write("a.csv", "landmark,x,y\nnose,0,0\neye,1,0\nchin,1,1\n");
    write("n.csv", "x,y\n0,0\n1,0\n1,1\n");
  }

  static LandmarkFile linked(const std::string& shapes, const std::string& table, const std::string& landmarks = "") {
    write("links.csv", table);
    return read_landmark_file(shapes, {.landmarks = landmarks, .links = "links.csv"});
  }

  static Pairs links(const std::string& shapes, const std::string& table) {
    return linked(shapes, table).shapes.front().links;
  }
};

TEST_F(Links, AreTheConnectivityOfMenpo) {
  const Landmarks shape =
      read_one("a.ljson", R"({"landmarks": {"connectivity": [[0, 1], [2, 1]], "points": [[1, 2], [3, 4], [5, 6]]},)"
                          R"( "labels": [{"label": "all", "mask": [0, 1, 2]}], "version": 2})");
  EXPECT_THAT(shape.links, ElementsAre(Pair(0, 1), Pair(2, 1)));
  EXPECT_THAT(read_error("b.ljson", R"({"landmarks": {"connectivity": [[0, 3]], "points": [[1, 2], [3, 4], [5, 6]]},)"
                                    R"( "labels": [], "version": 2})"),
              HasSubstr("joins landmarks that are not there; they are 0 to 2"));
}

TEST_F(Links, AreTheLinesOfVtk) {
  const Landmarks shape = read_one("a.vtk",
                                   "# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\nPOINTS 4 float\n"
                                   "0 0 0 1 0 0 0 1 0 0 0 1\nLINES 2 7\n3 0 1 2\n2 0 3\n");
  EXPECT_THAT(shape.links, ElementsAre(Pair(0, 1), Pair(1, 2), Pair(0, 3)));
}

TEST_F(Links, FollowTheLinesOfLabelme) {
  const Landmarks shape =
      read_one("a.json", R"({"imagePath": "a.png", "shapes": [{"label": "w", "shape_type": "linestrip",)"
                         R"( "points": [[0, 0], [5, 1], [9, 0]]}, {"label": "p", "shape_type": "polygon",)"
                         R"( "points": [[0, 5], [5, 6], [9, 5]]}]})");
  EXPECT_THAT(shape.links, ElementsAre(Pair(0, 1), Pair(1, 2), Pair(3, 4), Pair(4, 5), Pair(5, 3)));
}

TEST_F(Links, AreKeptByJsonAlone) {
  LandmarkFile file = read_landmark_file("a.csv");
  file.shapes.front().links = {{0, 1}, {1, 2}};
  EXPECT_THAT(write_landmark_file("b.json", file), IsEmpty());
  EXPECT_THAT(contents("b.json"), HasSubstr("\"links\":[[1,2],[2,3]]"));
  EXPECT_EQ(read_landmarks("b.json").links, file.shapes.front().links);
  EXPECT_THAT(write_landmark_file("b.csv", file), ElementsAre("b.csv: csv cannot hold links"));
}

TEST_F(Links, AreTablesOfNamesOrNumbers) {
  for (const char* table : {"nose,eye\neye,chin\n", "from;to\nnose;eye\neye;chin\n", "1,2\n2,3\n", "nose 2\n2 chin\n",
                            "\"\",\"V1\",\"V2\"\n\"1\",1,2\n\"2\",2,3\n", "\"V1\",\"V2\"\n\"1\",1,2\n\"2\",2,3\n"})
    EXPECT_THAT(links("a.csv", table), ElementsAre(Pair(0, 1), Pair(1, 2))) << table;
  EXPECT_THAT(links("n.csv", "start,end\n3,1\n"), ElementsAre(Pair(2, 0)));
}

TEST_F(Links, NoteWhatAShapeLacks) {
  const LandmarkFile file = linked("a.csv", "nose,eye\neye,ear\n");
  EXPECT_THAT(file.shapes.front().links, ElementsAre(Pair(0, 1)));
  EXPECT_THAT(file.warnings, ElementsAre("links.csv:2: 'ear' is no landmark of a.csv; the link is left out there"));
}

TEST_F(Links, RefuseWhatNamesNoLandmark) {
  const auto error = [](const std::string& shapes, const std::string& table) {
    return error_of([&] { linked(shapes, table); });
  };
  EXPECT_EQ(error("n.csv", "0,1\n1,2\n"),
            "links.csv:1: there is no landmark 0: links count from 1; add 1 to all numbers of a table from 0");
  EXPECT_THAT(error("a.csv", "ear,lip\n"), HasSubstr("links.csv:1: 'ear' is no landmark of a.csv; the columns need"));
  EXPECT_THAT(error("a.csv", "nose,nose\n"), HasSubstr("links.csv:1: the landmark 'nose' is joined to itself"));
  EXPECT_THAT(error("a.csv", "1,2,3,4\n"), HasSubstr("links.csv:1: 4 columns; a table of links has two"));
}

TEST_F(Links, ChangeWithAChoiceOfLandmarks) {
  EXPECT_THAT(linked("a.csv", "nose,eye\neye,chin\n", "chin,eye").shapes.front().links, ElementsAre(Pair(1, 0)));
}

}  // namespace
}  // namespace pulson::formats
