#include "pulson/fields/grid_fields.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grid_examples.hpp"
#include "temporary_folder.hpp"

namespace pulson::fields {
namespace {

using testing::EndsWith;
using testing::StartsWith;

using GridFields = InTemporaryFolder;

bool is_same(const std::vector<float>& a, const std::vector<float>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(float)) == 0;
}

TEST_F(GridFields, AreReadBackToTheSameBits) {
  for (const int d : {2, 3})
    for (const int components : {1, d})
      for (const bool compressed : {false, true})
        for (const char* const name : {"field.mha", "FIELD.NRRD"}) {
          SCOPED_TRACE(std::string(name) + " " + std::to_string(d) + " " + std::to_string(components));
          const GridField field = example_field(d, components);
          write_grid_field(name, field, compressed);
          const GridField back = read_grid_field(name);
          EXPECT_EQ(back.sizes, field.sizes);
          EXPECT_EQ(back.spacing, field.spacing);
          EXPECT_EQ(back.origin, field.origin);
          EXPECT_EQ(back.components, components);
          EXPECT_EQ(back.direction, Eigen::MatrixXd::Identity(d, d));
          EXPECT_TRUE(is_same(back.values, field.values));
        }
  EXPECT_EQ(count_entries(), 2U);
}

TEST_F(GridFields, KeepTheirDirection) {
  GridField field = example_field(2, 2);
  field.direction = (Eigen::Matrix2d() << 0.8, -0.6, 0.6, 0.8).finished();
  for (const char* const name : {"field.mha", "field.nrrd"}) {
    write_grid_field(name, field, false);
    const GridField back = read_grid_field(name);
    EXPECT_TRUE(back.direction.isApprox(field.direction, 1e-15)) << name << '\n' << back.direction;
    EXPECT_NEAR(back.spacing[1], field.spacing[1], 1e-15) << name;
  }
  EXPECT_THAT(contents("field.mha"), testing::HasSubstr("\nTransformMatrix = 0.8 0.6 -0.6 0.8\n"));
}

TEST_F(GridFields, AreCompressed) {
  GridField field = example_field(3, 3);
  field.sizes = {50, 50, 50};
  field.values.assign(3 * 50 * 50 * 50, 0.25F);
  for (const char* const name : {"field.mha", "field.nrrd"}) {
    write_grid_field(name, field);
    EXPECT_LT(std::filesystem::file_size(name), 10000U);
    EXPECT_TRUE(is_same(read_grid_field(name).values, field.values));
  }
}

TEST_F(GridFields, HaveTheHeaderOfMetaImage) {
  write_grid_field("field.mha", example_field(2, 2), false);
  EXPECT_THAT(
      contents("field.mha"),
      StartsWith("ObjectType = Image\nNDims = 2\nBinaryData = True\nBinaryDataByteOrderMSB = False\n"
                 "CompressedData = False\nTransformMatrix = 1 0 0 1\nOffset = -1.5 0.1\nCenterOfRotation = 0 0\n"
                 "ElementSpacing = 0.5 0.1\nDimSize = 4 3\nElementNumberOfChannels = 2\n"
                 "ElementType = MET_FLOAT\nElementDataFile = LOCAL\n"));
  write_grid_field("field.mha", example_field(3, 1));
  const std::string text = contents("field.mha");
  const std::size_t data = text.find("LOCAL\n") + 6;
  EXPECT_THAT(text, testing::HasSubstr("CompressedData = True\nCompressedDataSize = " +
                                       std::to_string(text.size() - data) + "\nTransformMatrix = 1 0 0 0 1 0 0 0 1\n"));
  EXPECT_EQ(text[data], '\x78') << "a zlib stream";
}

TEST_F(GridFields, HaveTheHeaderOfNrrd) {
  write_grid_field("field.nrrd", example_field(2, 2), false);
  EXPECT_THAT(contents("field.nrrd"),
              StartsWith("NRRD0004\ntype: float\ndimension: 3\nspace dimension: 2\nsizes: 2 4 3\n"
                         "space directions: none (0.5,0) (0,0.1)\nkinds: vector domain domain\nendian: little\n"
                         "encoding: raw\nspace origin: (-1.5,0.1)\n\n"));
  write_grid_field("field.nrrd", example_field(3, 1));
  EXPECT_THAT(contents("field.nrrd"),
              StartsWith("NRRD0004\ntype: float\ndimension: 3\nspace: left-posterior-superior\nsizes: 4 3 2\n"
                         "space directions: (0.5,0,0) (0,0.1,0) (0,0,2)\nkinds: domain domain domain\nendian: little\n"
                         "encoding: gzip\nspace origin: (-1.5,0.1,7)\n\n\x1f\x8b"));
}

TEST_F(GridFields, AreReadFromOtherTypes) {
  write("image.mha",
        "NDims = 2\r\nDimSize = 2 1\r\nElementType = MET_UCHAR\r\nBinaryData = True\r\n"
        "ElementDataFile = LOCAL\r\n\x80\x01");
  GridField field = read_grid_field("image.mha");
  EXPECT_EQ(field.values, (std::vector<float>{128, 1}));
  EXPECT_EQ(field.spacing, (std::vector<double>{1, 1}));
  EXPECT_EQ(field.origin, (std::vector<double>{0, 0}));

  const std::string header = "ObjectType = Image\nNDims = 2\nDimSize = 2 1\nBinaryData = True\n";
  write("image.mha", header + "ElementType = MET_SHORT\nBinaryDataByteOrderMSB = True\nElementDataFile = LOCAL\n" +
                         std::string("\x01\x00\xFF\xFE", 4));
  EXPECT_EQ(read_grid_field("image.mha").values, (std::vector<float>{256, -2}));

  const double numbers[] = {0.5, -3};
  write("image.nrrd",
        "NRRD0005\n# a comment\ntype: double\ndimension: 2\nsizes: 2 1\nspacings: 0.5 2\nkey:=value\n"
        "endian: little\nencoding: raw\n\n" +
            std::string(reinterpret_cast<const char*>(numbers), sizeof(numbers)));
  field = read_grid_field("image.nrrd");
  EXPECT_EQ(field.values, (std::vector<float>{0.5, -3}));
  EXPECT_EQ(field.spacing, (std::vector<double>{0.5, 2}));
}

TEST_F(GridFields, KeepTheTypeOfTheirNumbers) {
  const float limit = std::numeric_limits<float>::max();
  GridField field{{4, 1}, {1, 1}, {0, 0}, 1, {2.6F, -limit, limit, std::numeric_limits<float>::quiet_NaN()}};
  struct Example {
    GridType type;
    std::vector<float> read;
    std::string meta_image, nrrd;
  };
  const std::vector<Example> examples = {
      {GridType::kInt8, {3, -128, 127, 0}, "MET_CHAR", "signed char"},
      {GridType::kUint8, {3, 0, 255, 0}, "MET_UCHAR", "uchar"},
      {GridType::kInt16, {3, -32768, 32767, 0}, "MET_SHORT", "short"},
      {GridType::kUint16, {3, 0, 65535, 0}, "MET_USHORT", "ushort"},
      {GridType::kInt32, {3, -2147483648.0F, 2147483648.0F, 0}, "MET_INT", "int"},
      {GridType::kUint32, {3, 0, 4294967296.0F, 0}, "MET_UINT", "uint"},
      {GridType::kInt64, {3, -9223372036854775808.0F, 9223372036854775808.0F, 0}, "MET_LONG_LONG", "longlong"},
      {GridType::kUint64, {3, 0, 18446744073709551616.0F, 0}, "MET_ULONG_LONG", "ulonglong"},
      {GridType::kFloat64, field.values, "MET_DOUBLE", "double"}};
  for (const Example& example : examples)
    for (const std::string name : {"field.mha", "field.nrrd"}) {
      field.type = example.type;
      write_grid_field(name, field);
      const GridField back = read_grid_field(name);
      EXPECT_EQ(back.type, example.type) << name;
      EXPECT_TRUE(is_same(back.values, example.read)) << name << ' ' << example.meta_image;
      EXPECT_THAT(contents(name), testing::HasSubstr(name == "field.mha" ? "ElementType = " + example.meta_image + "\n"
                                                                         : "type: " + example.nrrd + "\n"));
    }
}

TEST_F(GridFields, AreRecognisedByTheirContent) {
  const GridField field = example_field(2, 2);
  write_grid_field("field.mha", field);
  std::filesystem::rename("field.mha", "field.nrrd");
  EXPECT_TRUE(is_same(read_grid_field("field.nrrd").values, field.values));
}

/// NRRD files may have an axis of one component, kinds that say nothing, blanks in vectors and short names.
TEST_F(GridFields, AreReadFromTheVariantsOfNrrd) {
  const std::string header = "NRRD0004\ntype: unsigned char\nencoding: raw\n";
  write("a.nrrd", header + "dimension: 3\nsizes: 1 2 1\nkinds: list domain domain\nspacings: nan 0.5 2\n\n\x07\x08");
  GridField field = read_grid_field("a.nrrd");
  EXPECT_EQ(field.components, 1);
  EXPECT_EQ(field.sizes, (std::vector<int>{2, 1}));
  EXPECT_EQ(field.spacing, (std::vector<double>{0.5, 2}));
  write("a.nrrd", header +
                      "dimension: 3\nsizes: 2 1 1\nkinds: ??? space space\nspacedirections: none ( 0, 2 )  (-1,0)\n"
                      "measurement frame: (1,0) (0,1)\n\n\x07\x08");
  field = read_grid_field("a.nrrd");
  EXPECT_EQ(field.components, 2);
  EXPECT_EQ(field.spacing, (std::vector<double>{2, 1}));
  EXPECT_EQ(field.direction, (Eigen::Matrix2d() << 0, -1, 1, 0).finished());
  write("a.nrrd", header + "dimension: 4\nsizes: 3 1 1 1\nspace: LPS\n\n\x07\x08\x09");
  EXPECT_EQ(read_grid_field("a.nrrd").values, (std::vector<float>{7, 8, 9}));
}

}  // namespace
}  // namespace pulson::fields
