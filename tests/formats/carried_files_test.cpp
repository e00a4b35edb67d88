// Files whose points move: everything else stays, byte for byte.
#include <algorithm>
#include <cmath>
#include <cstring>
#include <string>

#include <gmock/gmock.h>

#include "error_of.hpp"
#include "formats/carriers/carried_file.hpp"
#include "formats/carriers/vtp_blocks.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

using testing::HasSubstr;

/// Every point moved by (1, 2, 4), with normals as they are.
std::string shifted(const std::string& path, const std::string& text, int dimension = 3,
                    const ReadOptions& options = {}) {
  const auto file = carry(path, text, options, dimension);
  if (!file) return "not carried";
  Points points = file->shape.points;
  points.colwise() += Eigen::Vector3d(1, 2, 4).head(points.rows());
  return file->with(points, file->normals);
}

std::string unchanged(const std::string& path, const std::string& text, int dimension = 3) {
  const auto file = carry(path, text, {}, dimension);
  return file ? file->with(file->shape.points, file->normals) : "not carried";
}

// ---- tables

struct TableCase {
  const char* name;
  const char* text;
  const char* result;
};

const TableCase kTables[] = {
    {"columns", "id,x,y,cell_type,area\nc1,10.5,20.5,T,033\n\"c,2\",60,33,\" B \",2.50\n",
     "id,x,y,cell_type,area\nc1,11.5,22.5,T,033\n\"c,2\",61,35,\" B \",2.50\n"},
    {"order", "area,y,name,x\n1.0,2,\"a\",3\n2.0,4,\"b\",5\n", "area,y,name,x\n1.0,4,\"a\",4\n2.0,6,\"b\",6\n"},
    {"semicolons_and_decimal_commas", "id;x;y;w\r\na;1,5;2;0,10\r\nb;2;3,25;1,0\r\n",
     "id;x;y;w\r\na;2,5;4;0,10\r\nb;3;5,25;1,0\r\n"},
    {"quoted_decimal_commas", "x,y,w\n\"1,5\",2,a\n3,\"2,5\",b\n", "x,y,w\n\"2,5\",4,a\n4,\"4,5\",b\n"},
    {"tabs", "x\ty\tnote\n1\t2\t a b \n3\t4\t\n", "x\ty\tnote\n2\t4\t a b \n4\t6\t\n"},
    {"blanks", "1 2\n 3   4 \n", "2 4\n 4   6 \n"},
    {"byte_order_mark_and_comments", "\xEF\xBB\xBF# made by hand\nx,y,n\n# a note\n1,2,a\n\n3,4,b\n# end",
     "\xEF\xBB\xBF# made by hand\nx,y,n\n# a note\n2,4,a\n\n4,6,b\n# end"},
    {"named_separator", "sep=;\nx;y;n\n1;2;a\n", "sep=;\nx;y;n\n2;4;a\n"},
    {"no_header", "10,20\n30,40", "11,22\n31,42"},
    {"names_without_header", "a,1,2\nb,3,4\n", "a,2,4\nb,4,6\n"},
    {"quoted_numbers_and_lines", "\"x\",\"y\",\"t\"\n\"1\",\"2\",\"one\ntwo \"\"3\"\"\"\n\"5\",\"6\",\"\"\n",
     "\"x\",\"y\",\"t\"\n\"2\",\"4\",\"one\ntwo \"\"3\"\"\"\n\"6\",\"8\",\"\"\n"},
    {"missing", "id,x,y\na,NA,NA\nb,,\nc,1,2\nd,5,\n", "id,x,y\na,NA,NA\nb,,\nc,2,4\nd,NA,NA\n"},
    {"wide", "id,sex,x1,y1,x2,y2\na,f,1,2,3,4\nb,m,5,6,NA,8\n", "id,sex,x1,y1,x2,y2\na,f,2,4,4,6\nb,m,6,8,NA,NA\n"},
    {"centroids", "\"cell_id\",\"x_centroid\",\"y_centroid\",\"n\"\n\"a\",1,2,3\n\"a\",3,4,5\n",
     "\"cell_id\",\"x_centroid\",\"y_centroid\",\"n\"\n\"a\",2,4,3\n\"a\",4,6,5\n"},
    {"repeated_labels", "label,x,y\nT,1,2\nB,3,4\nT,5,6\n", "label,x,y\nT,2,4\nB,4,6\nT,6,8\n"},
    {"names_of_r", "\"x\",\"y\",\"g\"\n\"1\",1,2,\"a\"\n\"2\",3,4,\"b\"\n",
     "\"x\",\"y\",\"g\"\n\"1\",2,4,\"a\"\n\"2\",4,6,\"b\"\n"},
    {"windows_1252", "x,y,n\n1,2,caf\xE9\n", "x,y,n\n2,4,caf\xE9\n"},
};

class CarriedTable : public testing::TestWithParam<TableCase> {};

TEST_P(CarriedTable, KeepsAllButTheCoordinates) {
  EXPECT_EQ(shifted("cells.csv", GetParam().text, 2), GetParam().result);
}

INSTANTIATE_TEST_SUITE_P(All, CarriedTable, testing::ValuesIn(kTables),
                         [](const auto& parameter) { return parameter.param.name; });

TEST(CarriedTables, HaveNumbersInTheFewestDigits) {
  const auto file = carry("t.csv", "x,y\n1,2\n", {}, 2);
  EXPECT_EQ(file->with((Points(2, 1) << 0.1 + 0.2, 1e-7).finished(), {}), "x,y\n0.30000000000000004,1e-07\n");
}

TEST(CarriedTables, ReadColumnsThatOptionsName) {
  ReadOptions options;
  options.columns = {{"x", "col"}, {"y", "row"}};
  EXPECT_EQ(shifted("t.tsv", "spot\trow\tcol\tin\nAA\t1\t2\t0\n", 2, options), "spot\trow\tcol\tin\nAA\t3\t3\t0\n");
  options = {.negative_is_missing = true};
  const auto file = carry("t.csv", "x,y,n\n-1,-1,a\n1,2,b\n", options, 2);
  EXPECT_EQ(file->with(file->shape.points, {}), "x,y,n\nNA,NA,a\n1,2,b\n");
}

TEST(CarriedTables, AreNotThoseWithoutAPointInEachRow) {
  EXPECT_EQ(shifted("t.csv", "1,2,3,4,5\n1,2,3,4,5\n", 2), "not carried") << "lines of all x and all y";
  EXPECT_EQ(shifted("t.csv", "landmark,axis,value\n1,x,5\n1,y,6\n", 2), "not carried");
  EXPECT_EQ(shifted("t.csv", "x,y\n1,2\n", 2, {.landmarks = "1"}), "not carried");
}

TEST(CarriedTables, NameTheLineOfAnError) {
  const auto error = [](const std::string& text) { return error_of([&] { carry("t.csv", text, {}, 2); }); };
  EXPECT_THAT(error("x,y,n\n1,2,a\n3,4\n"), HasSubstr("t.csv:3: 2 columns"));
  EXPECT_THAT(error("x,y\n1,2\n3,four\n"), HasSubstr("t.csv:3: landmark 2: y is 'four'"));
  EXPECT_THAT(error("x;y\n1,5;2.5\n"), HasSubstr("t.csv:2: a coordinate has a comma"));
}

TEST(CarriedTables, AreThoseOfDeepLabCut) {
  const std::string head =
      "scorer,dlc,dlc,dlc,dlc,dlc,dlc\nbodyparts,nose,nose,nose,tail,tail,tail\ncoords,x,y,likelihood,x,y,likelihood\n";
  EXPECT_EQ(shifted("t.csv", head + "0,1,2,0.90,3,4,0.5\n1,5,6,0.1,,,\n", 2),
            head + "0,2,4,0.90,4,6,0.5\n1,6,8,0.1,,,\n");
}

TEST(CarriedTables, AreThoseOfSlicer) {
  const std::string head =
      "# Markups fiducial file version = 4.13\n# CoordinateSystem = LPS\n"
      "# columns = id,x,y,z,ow,ox,oy,oz,vis,sel,lock,label,desc,associatedNodeID\n";
  const auto file = carry("a.fcsv", head + "v1,1,2,3,0,0,0,1,0,1,1,\"n, 1\",a text,vol2\n", {}, 3);
  EXPECT_EQ(file->shape.axes, "LPS");
  EXPECT_EQ(file->shape.units, "mm");
  EXPECT_EQ(shifted("a.fcsv", file->text()), head + "v1,2,4,7,0,0,0,1,0,1,1,\"n, 1\",a text,vol2\n");
}

// ---- meshes

template <class Number>
void put(std::string& bytes, Number number, bool is_big) {
  char raw[sizeof number];
  std::memcpy(raw, &number, sizeof number);
  if (is_big) std::reverse(raw, raw + sizeof number);
  bytes.append(raw, sizeof number);
}

std::string text_ply(const std::string& vertices) {
  return "ply\nformat ascii 1.0\ncomment by hand\nelement vertex 2\nproperty float x\nproperty float y\n"
         "property float z\nproperty uchar red\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n" +
         vertices + "3 0 1 1\n";
}

TEST(CarriedMeshes, KeepColoursAndFacesOfPly) {
  EXPECT_EQ(shifted("m.ply", text_ply("0.5 0 0 255\n10 0.1 0 7\n")), text_ply("1.5 2 4 255\n11 2.1 4 7\n"));
}

std::string binary_ply(bool is_big, double x) {
  std::string bytes = std::string("ply\nformat binary_") + (is_big ? "big" : "little") +
                      "_endian 1.0\nelement vertex 1\nproperty uchar red\nproperty double x\nproperty float y\n"
                      "property float z\nproperty float nx\nproperty float ny\nproperty float nz\nelement face 1\n"
                      "property list uchar int vertex_indices\nend_header\n";
  put<std::uint8_t>(bytes, 10, is_big);
  put<double>(bytes, x, is_big);
  put<float>(bytes, static_cast<float>(x + 1), is_big);
  put<float>(bytes, static_cast<float>(x + 3), is_big);
  for (const float n : {0.0F, 0.6F, 0.8F}) put(bytes, n, is_big);
  put<std::uint8_t>(bytes, 3, is_big);
  for (int i = 0; i < 3; ++i) put<std::int32_t>(bytes, 0, is_big);
  return bytes;
}

TEST(CarriedMeshes, StayBinary) {
  for (const bool is_big : {false, true}) {
    const auto file = carry("m.ply", binary_ply(is_big, 0.1), {}, 3);
    ASSERT_EQ(file->normals.cols(), 1);
    EXPECT_EQ(static_cast<float>(file->normals(1, 0)), 0.6F);
    Points points = file->shape.points;
    points.colwise() = Eigen::Vector3d(7, 8, 10);
    EXPECT_EQ(file->with(points, file->normals), binary_ply(is_big, 7));
    EXPECT_EQ(unchanged("m.ply", binary_ply(is_big, 0.1)), binary_ply(is_big, 0.1));
  }
}

TEST(CarriedMeshes, RefuseWholeNumbers) {
  std::string text = text_ply("0 0 0 255\n10 0 0 7\n");
  text.replace(text.find("float x"), 7, "short x");
  EXPECT_THAT(error_of([&] { carry("m.ply", text, {}, 3); }), HasSubstr("of the type 'short'"));
}

TEST(CarriedMeshes, KeepMaterialsAndTexturesOfObj) {
  const auto file = carry("m.obj",
                          "# c\nmtllib m.mtl\nv 0 0 0 1 0 0\nv  1.0\t0 0\nvt 0.5 0.5\nvn 0 0 1\nvn 1 0 0\no part\n"
                          "usemtl skin\ns 1\nf 1/1/1 2/1/2 1/1/1\nf 1//1 2//2 1//1\nf 1/1 2/1 1/1\nl 1 2\n",
                          {}, 3);
  Points points = file->shape.points;
  points.row(2).array() += 2.5;
  EXPECT_EQ(file->with(points, file->normals),
            "# c\nmtllib m.mtl\nv 0 0 2.5 1 0 0\nv  1\t0 2.5\nvt 0.5 0.5\no part\nusemtl skin\ns 1\n"
            "f 1/1 2/1 1/1\nf 1 2 1\nf 1/1 2/1 1/1\nl 1 2\n");
  EXPECT_THAT(file->notes, testing::ElementsAre(HasSubstr("2 normals (vn) left out")));
}

TEST(CarriedMeshes, MakeTheNormalsOfStlAgain) {
  const std::string text =
      "solid a b\n facet normal 0 0 1\n  outer loop\n   vertex 0 0 0\n   vertex 1 0 0\n   vertex 0 1 0\n  endloop\n"
      " endfacet\nendsolid a b\n";
  const auto file = carry("m.stl", text, {}, 3);
  ASSERT_EQ(file->shape.count(), 3);
  const Points turned = (Points(3, 3) << 0, 0, 0, 0, 2, 0, 0, 0, 2).finished();
  EXPECT_EQ(file->with(turned, {}),
            "solid a b\n facet normal 1 0 0\n  outer loop\n   vertex 0 0 0\n   vertex 0 2 0\n   vertex 0 0 2\n"
            "  endloop\n endfacet\nendsolid a b\n");
  std::string bytes(80, '#');
  put<std::uint32_t>(bytes, 1, false);
  for (const float number : {0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F, 0.0F, 0.0F, 1.0F, 0.0F})
    put(bytes, number, false);
  bytes += "ab";
  EXPECT_EQ(unchanged("m.stl", bytes), bytes);
  const std::string moved = carry("m.stl", bytes, {}, 3)->with(turned, {});
  EXPECT_EQ(moved.size(), bytes.size());
  EXPECT_THAT(moved, testing::EndsWith("ab"));
  float normal = 0;
  std::memcpy(&normal, moved.data() + 84, 4);
  EXPECT_EQ(normal, 1);
}

std::string text_vtk(const std::string& points, const std::string& rest) {
  return "# vtk DataFile Version 4.2\nout SPACE=RAS\nASCII\nDATASET POLYDATA\nPOINTS 3 float\n" + points +
         "\nPOLYGONS 1 4\n3 0 1 2\nCELL_DATA 1\n" + rest +
         "POINT_DATA 3\nSCALARS s float 1\nLOOKUP_TABLE default\n1 2 3\nFIELD FieldData 1\nk 1 3 int\n4 5 6\n";
}

TEST(CarriedMeshes, KeepScalarsOfVtk) {
  const auto file = carry("m.vtk", text_vtk("0 0 0 1 0 0\n0 1 0.5", ""), {}, 3);
  EXPECT_EQ(file->shape.axes, "RAS");
  EXPECT_EQ(shifted("m.vtk", file->text()), text_vtk("1 2 4 2 2 4\n1 3 4.5", ""));
  EXPECT_EQ(unchanged("m.vtk", text_vtk("0 0 0 1 0 0\n0 1 0.5", "NORMALS n float\n0 0 1\n")),
            text_vtk("0 0 0 1 0 0\n0 1 0.5", "\n"));
}

TEST(CarriedMeshes, KeepHeightsInThePlane) {
  const std::string text =
      "# vtk DataFile Version 3.0\na\nASCII\nDATASET POLYDATA\nPOINTS 2 double\n0 0 7.50\n1 0 7.50\n";
  const auto file = carry("m.vtk", text, {}, 2);
  ASSERT_EQ(file->shape.dimension(), 2);
  EXPECT_THAT(shifted("m.vtk", text, 2), HasSubstr("1 2 7.50\n2 2 7.50\n"));
}

TEST(CarriedMeshes, AreBinaryVtkWithNormals) {
  const auto make = [](double x) {
    std::string text = "# vtk DataFile Version 5.1\na\nBINARY\nDATASET POLYDATA\nPOINTS 1 double\n";
    for (int i = 0; i < 3; ++i) put<double>(text, x + i, true);
    text += "\nVERTICES 2 1\nOFFSETS vtktypeint64\n";
    for (const std::int64_t id : {0, 1}) put<std::int64_t>(text, id, true);
    text += "\nCONNECTIVITY vtktypeint64\n";
    put<std::int64_t>(text, 0, true);
    text += "\nPOINT_DATA 1\nNORMALS Normals float\n";
    for (const float n : {0.0F, 0.0F, 1.0F}) put(text, n, true);
    return text + "\n";
  };
  const auto file = carry("m.vtk", make(0.1), {}, 3);
  EXPECT_EQ(file->normals.col(0), Eigen::Vector3d(0, 0, 1));
  EXPECT_EQ(file->with(Eigen::Vector3d(5, 6, 7), file->normals), make(5));
}

// ---- VTK's XML

std::string floats(const std::vector<float>& numbers) {
  std::string bytes;
  for (const float number : numbers) put(bytes, number, false);
  return bytes;
}

std::string vtp_with(const std::string& head, const std::string& points, const std::string& scalars,
                     const std::string& after) {
  return "<?xml version=\"1.0\"?>\n<!-- <a> -->\n<VTKFile type=\"PolyData\" byte_order=\"LittleEndian\"" + head +
         ">\n<PolyData>\n<Piece NumberOfPoints=\"2\">\n<PointData Scalars=\"s\">" + scalars + "</PointData>\n<Points>" +
         points + "</Points>\n</Piece>\n</PolyData>\n" + after + "</VTKFile>\n";
}

std::string array(const std::string& attributes, const std::string& content) {
  return "<DataArray type=\"Float32\" Name=\"p\" NumberOfComponents=\"3\" " + attributes + ">" + content +
         "</DataArray>";
}

TEST(CarriedMeshes, AreVtpAsText) {
  const std::string scalars = "<DataArray type=\"Int32\" Name=\"s\" format=\"ascii\">1 2</DataArray>";
  EXPECT_EQ(
      shifted("m.vtp", vtp_with("", array("format=\"ascii\" RangeMin=\"0\" RangeMax=\"1\"", "\n 0 0 0\n 1 0.5 0\n"),
                                scalars, "")),
      vtp_with("", array("format=\"ascii\"", "\n 1 2 4\n 2 2.5 4\n"), scalars, ""));
}

struct VtpCase {
  const char* name;
  VtpEncoding encoding;
  const char* head;
};

const VtpCase kVtpCases[] = {
    {"plain", {}, ""},
    {"long_headers", {.header_size = 8}, " header_type=\"UInt64\""},
    {"compressed", {.is_compressed = true}, " compressor=\"vtkZLibDataCompressor\""},
    {"raw", {.is_base64 = false}, ""},
    {"raw_compressed", {.is_compressed = true, .is_base64 = false}, " compressor=\"vtkZLibDataCompressor\""},
};

class CarriedVtp : public testing::TestWithParam<VtpCase> {
 protected:
  std::string block(const std::string& bytes, std::size_t part_size = 16) const {
    return vtp_block_text({.part_size = part_size}, bytes, GetParam().encoding);
  }
};

TEST_P(CarriedVtp, HoldsAppendedBlocks) {
  const auto make = [&](const std::vector<float>& numbers) {
    const std::string points = block(floats(numbers));
    const std::string other = block(floats({1, 2}));
    const std::string scalars =
        "<DataArray type=\"Float32\" Name=\"s\" format=\"appended\" offset=\"" + std::to_string(points.size()) + "\"/>";
    return vtp_with(GetParam().head, array("format=\"appended\" offset=\"0\"", ""), scalars,
                    std::string("<AppendedData encoding=\"") + (GetParam().encoding.is_base64 ? "base64" : "raw") +
                        "\">\n _" + points + other + "\n</AppendedData>\n");
  };
  EXPECT_EQ(shifted("m.vtp", make({0, 0, 0, 0, 0, 0})), make({1, 2, 4, 1, 2, 4}));
}

TEST_P(CarriedVtp, HoldsBlocksInTheirArrays) {
  if (!GetParam().encoding.is_base64) return;
  const auto make = [&](const std::vector<float>& numbers, const std::string& key) {
    return vtp_with(GetParam().head, array("format=\"binary\"", "\n  " + block(floats(numbers)) + "\n  " + key), "",
                    "");
  };
  EXPECT_EQ(shifted("m.vtp", make({0, 0, 0, 1, 1, 1}, "<InformationKey name=\"L2_NORM_RANGE\">1</InformationKey>\n")),
            make({1, 2, 4, 2, 3, 5}, "\n"));
}

// Whatever a damaged file says of its sizes.
TEST_P(CarriedVtp, RefusesBrokenBlocks) {
  const std::string whole = block(floats({1, 2, 3, 4, 5, 6}));
  for (std::size_t cut = 0; cut < whole.size(); ++cut) {
    std::string text(whole.substr(0, cut));
    EXPECT_THROW(read_vtp_block("m.vtp", text, 0, GetParam().encoding), InputError) << cut;
    text = whole;
    text[cut] = GetParam().encoding.is_base64 ? '/' : '\xFF';
    try {
      EXPECT_LE(read_vtp_block("m.vtp", text, 0, GetParam().encoding).bytes.size(), 1032 * text.size());
    } catch (const InputError&) {
    }
  }
}

INSTANTIATE_TEST_SUITE_P(All, CarriedVtp, testing::ValuesIn(kVtpCases),
                         [](const auto& parameter) { return parameter.param.name; });

TEST(CarriedMeshes, LeaveOutTheNormalsOfVtpCells) {
  const std::string text =
      "<VTKFile type=\"PolyData\"><PolyData><Piece><Points><DataArray type=\"Float64\" NumberOfComponents=\"3\" "
      "format=\"ascii\">0 0 0</DataArray></Points><CellData Normals=\"n\"><DataArray type=\"Float32\" Name=\"n\" "
      "NumberOfComponents=\"3\" format=\"ascii\">0 0 1</DataArray><DataArray Name=\"k\" format=\"ascii\">1</DataArray>"
      "</CellData></Piece></PolyData></VTKFile>";
  EXPECT_THAT(unchanged("m.vtp", text),
              HasSubstr("<CellData><DataArray Name=\"k\" format=\"ascii\">1</DataArray></CellData>"));
}

TEST(CarriedMeshes, NameWhatVtpCannotBe) {
  EXPECT_THAT(error_of([] { carry("m.vtp", "<VTKFile type=\"ImageData\"></VTKFile>", {}, 3); }),
              HasSubstr("it holds 'ImageData'"));
  EXPECT_THAT(error_of([] {
                carry("m.vtp", "<VTKFile type=\"PolyData\" compressor=\"vtkLZ4DataCompressor\"></VTKFile>", {}, 3);
              }),
              HasSubstr("save it without compression"));
}

}  // namespace
}  // namespace pulson::formats
