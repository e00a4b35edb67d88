// Points that go through `warp`: tables and meshes come out whole. Links that pictures show.

#include <array>
#include <string>

#include <gmock/gmock.h>

#include "core/text.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "warp_program.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class WarpPoints : public WarpProgram {
 protected:
  /// A translation by (1, 2) and, in space, by 3.
  static void register_translation(int dimension, const std::string& axes = "") {
    const bool space = dimension == 3;
    if (!axes.empty()) {
      const std::string head = "# Markups fiducial file version = 4.13\n# CoordinateSystem = " + axes + "\n";
      write("a.fcsv", head +
                          "1,0,0,0,0,0,0,1,1,1,0,a,,\n2,9,0,0,0,0,0,1,1,1,0,b,,\n3,0,9,0,0,0,0,1,1,1,0,c,,\n"
                          "4,0,0,9,0,0,0,1,1,1,0,d,,\n");
      write("b.fcsv", head +
                          "1,1,2,3,0,0,0,1,1,1,0,a,,\n2,10,2,3,0,0,0,1,1,1,0,b,,\n3,1,11,3,0,0,0,1,1,1,0,c,,\n"
                          "4,1,2,12,0,0,0,1,1,1,0,d,,\n");
      return registered("a.fcsv b.fcsv");
    }
    write("a.csv", space ? "x,y,z\n0,0,0\n9,0,0\n0,9,0\n0,0,9\n" : "x,y\n0,0\n9,0\n9,9\n0,9\n");
    write("b.csv", space ? "x,y,z\n1,2,3\n10,2,3\n1,11,3\n1,2,12\n" : "x,y\n1,2\n10,2\n10,11\n1,11\n");
    registered("a.csv b.csv");
  }

  static void registered(const std::string& files) {
    const ProgramRun done = run(words("register " + files + " -o out --align translation --no-picture -q"));
    ASSERT_EQ(done.exit_code, 0) << done.err;
  }

  static ProgramRun moved(const std::string& from, const std::string& to, const std::string& options = "") {
    ProgramRun done = warp(from, "-o " + to + " " + options);
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return done;
  }
};

TEST_F(WarpPoints, KeepAllColumnsOfATable) {
  register_translation(2);
  write("cells.csv", "id,x,y,type,area\r\n007,1.5,2.5,\"T, helper\",33.0\r\n008,3,4,B,2.10\r\n");
  moved("cells.csv", "out.csv");
  EXPECT_EQ(contents("out.csv"), "id,x,y,type,area\r\n007,2.5,4.5,\"T, helper\",33.0\r\n008,4,6,B,2.10\r\n");
  write("spots.tsv", "# 10x\nbarcode\tin\tpx_row\tpx_col\nAAC-1\t1\t20\t10\n");
  moved("spots.tsv", "spots_out.tsv", "--columns x=px_col,y=px_row");
  EXPECT_EQ(contents("spots_out.tsv"), "# 10x\nbarcode\tin\tpx_row\tpx_col\nAAC-1\t1\t22\t11\n");
  moved("out.csv", "back.csv", "--inverse");
  EXPECT_EQ(contents("back.csv"), contents("cells.csv"));
  // Another format holds the points alone, and what is lost is listed.
  EXPECT_THAT(moved("cells.csv", "out.json").err, HasSubstr("columns that are not used: 'type', 'area'"));
  EXPECT_THAT(moved("spots.tsv", "spots.csv", "--columns x=px_col,y=px_row").err, HasSubstr("not used"));
  EXPECT_EQ(warp("cells.csv", "-o safe.csv --spreadsheet-safe").exit_code, 2);
}

TEST_F(WarpPoints, MoveAPointWholeOrNotAtAll) {
  register_translation(2);
  write("half.csv", "n,x,y\na,1,NA\nb,,\nc,3,4\nd,,5\n");
  EXPECT_THAT(
      moved("half.csv", "out.csv").err,
      HasSubstr("half.csv: 2 points lack a coordinate and cannot be moved: all of its coordinates are missing"));
  EXPECT_EQ(contents("out.csv"), "n,x,y\na,NA,NA\nb,,\nc,4,6\nd,NA,NA\n");
  write("half.json", R"({"shapes":[{"points":[[1,null],[3,4]],"curves":[[[null,1],[5,6]]]}]})");
  EXPECT_THAT(moved("half.json", "out.json").err, HasSubstr("2 points lack a coordinate"));
  const Landmarks shape = formats::read_landmarks("out.json");
  EXPECT_TRUE(shape.points.col(0).array().isNaN().all());
  EXPECT_TRUE(shape.curves.front().col(0).array().isNaN().all());
  EXPECT_EQ(shape.curves.front().col(1), Eigen::Vector2d(6, 8));
}

TEST_F(WarpPoints, KeepFacesAndDataOfMeshes) {
  register_translation(3);
  const std::array<std::array<std::string, 3>, 3> meshes = {
      {{"m.obj", "mtllib a.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvt 0 1\nf 1/1 2/1 3/1\n",
        "mtllib a.mtl\nv 1 2 3\nv 2 2 3\nv 1 3 3\nvt 0 1\nf 1/1 2/1 3/1\n"},
       {"m.ply",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        "property uchar red\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n0 0 0 9\n",
        "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nproperty float z\n"
        "property uchar red\nelement face 0\nproperty list uchar int vertex_indices\nend_header\n1 2 3 9\n"},
       {"m.vtk",
        "# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n0 0 0 1 1 1\nLINES 1 3\n"
        "2 0 1\nPOINT_DATA 2\nSCALARS s int 1\nLOOKUP_TABLE default\n7 8\n",
        "# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\nPOINTS 2 float\n1 2 3 2 3 4\nLINES 1 3\n"
        "2 0 1\nPOINT_DATA 2\nSCALARS s int 1\nLOOKUP_TABLE default\n7 8\n"}}};
  for (const auto& [name, before, after] : meshes) {
    write(name, before);
    moved(name, "moved_" + name);
    EXPECT_EQ(contents("moved_" + name), after);
    EXPECT_THAT(moved(name, "points.csv").err, HasSubstr("it gets the points of " + name + " alone"));
  }
  EXPECT_EQ(warp("m.ply", "-o m2.obj").err,
            "pulson: m2.obj: a mesh is written whole in the format of its file, here .ply\n");
}

TEST_F(WarpPoints, StayInTheAxesOfTheirFile) {
  register_translation(3, "LPS");
  write("m.vtk", "# vtk DataFile Version 3.0\na SPACE=RAS\nASCII\nDATASET POLYDATA\nPOINTS 1 double\n0 0 0\n");
  EXPECT_THAT(moved("m.vtk", "o.vtk").err, HasSubstr("its axes are RAS"));
  EXPECT_THAT(contents("o.vtk"), AllOf(HasSubstr("SPACE=RAS"), HasSubstr("\n-1 -2 3\n")));
  write("m.obj", "v 0 0 0\n");
  EXPECT_THAT(moved("m.obj", "o.obj").err, HasSubstr("it does not say where its axes point; they are taken as LPS"));
  write("p.fcsv", contents("a.fcsv") + "# end\n5,1,1,1,0,0,0,1,0,0,1,\"x, y\",text,node\n");
  moved("p.fcsv", "o.fcsv");
  EXPECT_THAT(contents("o.fcsv"), HasSubstr("# end\n5,2,3,4,0,0,0,1,0,0,1,\"x, y\",text,node\n"));
}

// The normals of a mesh are those of its faces before and after a map that is not a similarity.
TEST_F(WarpPoints, TurnNormals) {
  write("a.csv", "x,y,z\n0,0,0\n9,0,0\n0,9,0\n0,0,9\n9,9,9\n");
  write("b.csv", "x,y,z\n0,0,1\n9,0,2\n0,8,0\n1,0,9\n9,9,12\n");
  registered("a.csv b.csv");
  write("m.ply",
        "ply\nformat ascii 1.0\nelement vertex 3\nproperty double x\nproperty double y\nproperty double z\n"
        "property double nx\nproperty double ny\nproperty double nz\nelement face 0\n"
        "property list uchar int vertex_indices\nend_header\n3 3 3 0 0 1\n3.001 3 3 0 0 1\n3 3.001 3 0 0 1\n");
  for (const char* options : {"", "--inverse"}) {
    moved("m.ply", "o.ply", options);
    std::istringstream numbers(contents("o.ply").substr(contents("o.ply").find("end_header\n") + 11));
    std::array<Eigen::Vector3d, 6> rows;
    for (Eigen::Vector3d& row : rows) numbers >> row[0] >> row[1] >> row[2];
    const Eigen::Vector3d a = rows[2] - rows[0], b = rows[4] - rows[0];
    EXPECT_NEAR(rows[1].norm(), 1, 1e-12);
    EXPECT_LT(rows[1][2], 0.9999) << "it turns";
    EXPECT_NEAR(rows[1].dot(a.normalized()), 0, 1e-3);
    EXPECT_NEAR(rows[1].dot(b.normalized()), 0, 1e-3);
    EXPECT_GT(rows[1][2], 0) << "it stays on its side";
  }
}

TEST_F(WarpPoints, LinksAreRecordedAndDrawn) {
  write("a.csv", "landmark,x,y\nnose,0,0\neye,4,0\near,4,3\nchin,0,4\n");
  write("b.csv", "landmark,x,y\nnose,0,0.5\neye,4,0\near,5,3\nchin,0,4\n");
  write("links.csv", "from,to\nnose,ear\neye,chin\n");
  const ProgramRun without = run(words("register a.csv b.csv -o plain -q"));
  ASSERT_EQ(without.exit_code, 0) << without.err;
  const ProgramRun with = run(words("register a.csv b.csv -o out -q --links links.csv"));
  ASSERT_EQ(with.exit_code, 0) << with.err;
  EXPECT_EQ(read_json("out/registration.json")["source_shape"]["links"].dump(), "[[1,3],[2,4]]");
  EXPECT_FALSE(read_json("plain/registration.json")["source_shape"].contains("links"));
  EXPECT_NE(contents("out/registration.svg"), contents("plain/registration.svg"));
  EXPECT_THAT(contents("out/report.html"), HasSubstr("\"outlines\":[[0,2],[1,3]]"));
  write("links.csv", "nose,lip\n");
  EXPECT_EQ(run(words("register a.csv b.csv -o out -q --links links.csv")).err,
            "pulson: links.csv:1: 'lip' is no landmark of b.csv; the columns need labels of the landmarks, or their "
            "numbers from 1\n");
}

TEST_F(WarpPoints, LinksAreDrawnOfCohorts) {
  std::filesystem::copy_file(std::filesystem::path(PULSON_SOURCE_DIR) / "sample_shapes/leaves.tps", "leaves.tps");
  write("links.csv", "1,3\n3,4\n");
  for (const std::string line : {"atlas leaves.tps -q -o ", "compare leaves.tps#1 leaves.tps#2 -q -o "}) {
    const ProgramRun plain = run(words(line + "plain")), linked = run(words(line + "linked --links links.csv"));
    ASSERT_EQ(plain.exit_code, 0) << plain.err;
    ASSERT_EQ(linked.exit_code, 0) << linked.err;
    std::size_t changed = 0, pictures = 0;
    for (const std::string& name : names_in("linked"))
      if (name.ends_with(".svg")) {
        ++pictures;
        changed += contents("linked/" + name) != contents("plain/" + name) ? 1 : 0;
      }
    EXPECT_GT(pictures, 0U) << line;
    EXPECT_GT(changed, 0U) << line;
    std::filesystem::remove_all("plain");
    std::filesystem::remove_all("linked");
  }
}

}  // namespace
}  // namespace pulson
