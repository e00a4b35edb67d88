#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "grid_examples.hpp"
#include "pulson/fields/grid_fields.hpp"
#include "temporary_folder.hpp"

namespace pulson::fields {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class WrongGridFields : public InTemporaryFolder {
 protected:
  static std::string error_of_reading(const std::string& text) {
    write("file", text);
    return error_of([] { read_grid_field("file"); });
  }

  /// Of a MetaImage file of 2 × 1 bytes with other or more lines.
  static std::string meta_image_error(const std::string& lines, const std::string& last = "ElementDataFile = LOCAL\n") {
    return error_of_reading("NDims = 2\n" + lines + last + "\x01\x02");
  }

  static std::string nrrd_error(const std::string& lines, const std::string& data = "\x01\x02") {
    return error_of_reading("NRRD0004\n" + lines + "\n" + data);
  }

  static std::string error_of_writing(const GridField& field, const std::string& name = "f.mha") {
    return error_of([&] { write_grid_field(name, field); });
  }
};

TEST_F(WrongGridFields, AreNotWritten) {
  const GridField good = example_field(2, 2);
  EXPECT_EQ(error_of_writing(good, "f.vtk"), "grid field 'f.vtk': its extension is '.vtk'; it must be .mha or .nrrd");
  EXPECT_EQ(error_of_writing(good, "no/f.mha"), "cannot write 'no/f.mha': there is no folder 'no'");
  GridField field = good;
  field.sizes = {24};
  EXPECT_EQ(error_of_writing(field), "grid field 'f.mha': its dimension is 1; it must be 2 or 3");
  field.sizes = {0, 3};
  EXPECT_EQ(error_of_writing(field), "grid field 'f.mha': a size is 0; it must be 1 or greater");
  field.sizes = {4, 4};
  EXPECT_EQ(error_of_writing(field), "grid field 'f.mha': it has 24 values; sizes 4 × 4 of 2 numbers need 32");
  field = good;
  field.components = 3;
  EXPECT_EQ(error_of_writing(field), "grid field 'f.mha': each point has 3 numbers; it must be 1 or, in 2D, 2");
  field = good;
  field.spacing[1] = 0;
  EXPECT_EQ(error_of_writing(field), "grid field 'f.mha': a spacing is 0; it must be finite and greater than 0");
  field.spacing = {1};
  EXPECT_EQ(error_of_writing(field), "grid field 'f.mha': 1 spacing and 2 coordinates of the origin for 2 axes");
  field = good;
  field.origin[0] = std::numeric_limits<double>::infinity();
  EXPECT_EQ(error_of_writing(field), "grid field 'f.mha': the origin has inf; it must be finite");
  field = good;
  field.direction = Eigen::MatrixXd::Identity(3, 3);
  EXPECT_EQ(error_of_writing(field), "grid field 'f.mha': the direction is 3×3; it must be 2×2");
  field.direction = (Eigen::Matrix2d() << 1, 1, 0, 0).finished();
  EXPECT_EQ(error_of_writing(field),
            "grid field 'f.mha': the directions of its axes must be unit vectors that span the space");
  EXPECT_EQ(count_entries(), 0U);
}

TEST_F(WrongGridFields, AreNoFiles) {
  EXPECT_EQ(error_of([] { read_grid_field("absent.mha"); }), "cannot read 'absent.mha': No such file or directory");
  EXPECT_EQ(error_of_reading(""), "file is empty");
  EXPECT_EQ(error_of_reading("x,y\n1,2\n"), "file is neither MetaImage (.mha) nor NRRD (.nrrd); it begins with 'x,y'");
}

/// A truncated file is reported, wherever it ends.
TEST_F(WrongGridFields, AreCutOff) {
  for (const bool compressed : {false, true})
    for (const char* const name : {"f.mha", "f.nrrd"}) {
      write_grid_field(name, example_field(3, 3), compressed);
      const std::string whole = contents(name);
      for (std::size_t size = 0; size < whole.size(); size += 11)
        EXPECT_NE(error_of_reading(whole.substr(0, size)), "no error") << name << ' ' << size;
    }
  write_grid_field("f.mha", example_field(2, 1), false);
  EXPECT_EQ(error_of_reading(contents("f.mha") + "\n"),
            "file: sizes 4 × 3 of 1 number of 4 bytes need 48 bytes; after its header the file has 49");
  write_grid_field("f.mha", example_field(2, 1));
  EXPECT_THAT(error_of_reading(contents("f.mha").substr(0, contents("f.mha").size() - 8)),
              StartsWith("file: its compressed numbers are cut off: "));
}

TEST_F(WrongGridFields, AreDamaged) {
  write_grid_field("f.nrrd", example_field(3, 3));
  std::string whole = contents("f.nrrd");
  whole[whole.size() - 6] = static_cast<char>(whole[whole.size() - 6] ^ 1);
  EXPECT_EQ(error_of_reading(whole), "file: its compressed numbers are damaged: zlib says incorrect data check");
  whole[whole.find("\n\n") + 2] = 'x';
  EXPECT_EQ(error_of_reading(whole), "file: its compressed numbers are damaged: zlib says incorrect header check");
}

TEST_F(WrongGridFields, ClaimMoreThanTheyHold) {
  const std::string type = "ElementType = MET_FLOAT\nBinaryData = True\n";
  EXPECT_EQ(meta_image_error(type + "DimSize = 30000 30000\n"),
            "file: sizes 30000 × 30000 of 1 number of 4 bytes need 3600000000 bytes; after its header the file has 2");
  EXPECT_EQ(meta_image_error(type + "CompressedData = True\nDimSize = 30000 30000\n"),
            "file: its compressed numbers are cut off: 2 compressed bytes cannot be 3600000000");
  EXPECT_EQ(
      error_of_reading("NDims = 3\nDimSize = 2147483647 2147483647 2147483647\n" + type + "ElementDataFile = LOCAL\n"),
      "file: its grid has 2147483647 x 2147483647 x 2147483647 points, more than `max_points = 1073741824` allows");
  EXPECT_EQ(meta_image_error("DimSize = 2147483648 1\n"),
            "file:2: DimSize is '2147483648 1'; whole numbers from 1 to 2147483647 are needed");
  // Too many numbers in the stream.
  write_grid_field("f.mha", example_field(2, 1));
  std::string whole = contents("f.mha");
  whole.replace(whole.find("4 3"), 3, "2 3");
  EXPECT_EQ(error_of_reading(whole), "file: its compressed numbers are more than the 24 bytes that its sizes need");
}

TEST_F(WrongGridFields, HaveWrongMetaImageHeaders) {
  const std::string good = "DimSize = 2 1\nElementType = MET_UCHAR\nBinaryData = True\n";
  EXPECT_EQ(meta_image_error(good), "no error");
  EXPECT_EQ(
      meta_image_error(good, "ElementDataFile = f.raw\n"),
      "file:5: ElementDataFile is 'f.raw'; numbers in another file are not read; they must be in this one (LOCAL)");
  EXPECT_EQ(meta_image_error(good, ""), "file:5: '\?\?' is in the header; 'Key = value' is needed");
  EXPECT_EQ(error_of_reading("NDims = 2\n" + good), "file: its header has no 'ElementDataFile'");
  EXPECT_EQ(meta_image_error("DimSize = 2\n"), "file:2: DimSize is '2'; 2 numbers are needed");
  EXPECT_EQ(meta_image_error("DimSize = 2 x\n"), "file:2: a number of DimSize is 'x'; a number is needed");
  EXPECT_EQ(meta_image_error(good + "NDims = 3\n"), "file:5: 'NDims' was given on line 1 already");
  EXPECT_EQ(meta_image_error(good + "Offset = 0 nan\n"), "file:5: Offset is '0 nan'; its numbers must be finite");
  EXPECT_EQ(meta_image_error(good + "ElementNumberOfChannels = 3\n"),
            "file:5: ElementNumberOfChannels is '3'; it must be 1 or 2");
  EXPECT_EQ(meta_image_error(good + "CompressedData = maybe\n"),
            "file:5: CompressedData is 'maybe'; it must be True or False");
  EXPECT_EQ(meta_image_error(good + "ElementSpacing = 1 -1\n"),
            "grid field 'file': a spacing is -1; it must be finite and greater than 0");
  EXPECT_EQ(meta_image_error("DimSize = 2 1\nElementType = MET_UCHAR\nBinaryData = False\n"),
            "file:4: BinaryData is 'False'; numbers as text are not read; it must be True");
  EXPECT_THAT(meta_image_error("DimSize = 2 1\nElementType = MET_STRING\n"),
              StartsWith("file:3: ElementType is 'MET_STRING'; it must be MET_FLOAT, "));
  EXPECT_EQ(error_of_reading("NDims = 4\nElementDataFile = LOCAL\n"), "file:1: NDims is '4'; it must be 2 or 3");
}

TEST_F(WrongGridFields, HaveWrongNrrdHeaders) {
  const std::string type = "type: uint8\nencoding: raw\n";
  const std::string good = type + "dimension: 2\nsizes: 2 1\n";
  EXPECT_EQ(nrrd_error(good), "no error");
  EXPECT_THAT(nrrd_error(good + "data file: f.raw\n"), HasSubstr("'f.raw'; numbers in another file are not read"));
  EXPECT_THAT(nrrd_error(good + "datafile: f.raw\n"), HasSubstr("'f.raw'; numbers in another file are not read"));
  EXPECT_EQ(error_of_reading("NRRD0004\ntype: float\n"),
            "file:3: the file ends in its header; an empty line and the numbers are needed");
  EXPECT_EQ(nrrd_error("what\n"), "file:2: 'what' is in the header; 'field: value' is needed");
  EXPECT_EQ(nrrd_error("type: block\nencoding: raw\ndimension: 2\nsizes: 2 1\n"),
            "file:2: type is 'block'; it must be float, double or a whole type such as uint8");
  EXPECT_EQ(nrrd_error("type: uint8\nencoding: text\ndimension: 2\nsizes: 2 1\n"),
            "file:3: encoding is 'text'; it must be raw or gzip");
  EXPECT_EQ(nrrd_error("type: short\nencoding: raw\ndimension: 2\nsizes: 1 1\n"), "file: its header has no 'endian'");
  EXPECT_EQ(nrrd_error(type + "dimension: 1\n"),
            "file:4: dimension is '1'; it must be 2 or 3, or with an axis of components 3 or 4");
  EXPECT_EQ(nrrd_error(type + "dimension: 2\nsizes: 2 1\nkinds: vector domain\n"),
            "file:4: dimension is '2'; its axes of space are 1, and must be 2 or 3");
  EXPECT_EQ(nrrd_error(type + "dimension: 3\nsizes: 4 1 1\nkinds: RGBA-color domain domain\n"),
            "file:5: sizes is '4 1 1'; the axis of components must have size 1 or 2");
  EXPECT_THAT(nrrd_error(type + "dimension: 3\nsizes: 2 1 1\nkinds: domain domain vector\n"),
              HasSubstr("the axis of components must be the first and the others domain"));
  EXPECT_THAT(nrrd_error(good + "space: right-anterior-superior\n"),
              HasSubstr("it must be left-posterior-superior in 3D"));
  EXPECT_THAT(nrrd_error(good + "space dimension: 3\n"), HasSubstr("the grid has 2 axes in space"));
  EXPECT_THAT(nrrd_error(good + "space directions: (1,0)\n"), HasSubstr("2 vectors are needed"));
  EXPECT_THAT(nrrd_error(good + "space directions: (1,0) 0,1\n"), HasSubstr("vectors such as (1,0) are needed"));
  EXPECT_THAT(nrrd_error(good + "space directions: (1,0) none\n"), HasSubstr("each axis in space needs a vector"));
  EXPECT_THAT(nrrd_error(good + "space directions: (1,0) (0,0)\n"), HasSubstr("a spacing is 0"));
  EXPECT_THAT(nrrd_error(good + "spacings:\n"), HasSubstr("2 numbers are needed"));
  EXPECT_THAT(nrrd_error(good + "space origin: none\n"), HasSubstr("one vector is needed"));
  EXPECT_THAT(nrrd_error(good + "axis mins: 0 0\n"), HasSubstr("positions are read from space origin"));
  EXPECT_THAT(nrrd_error(good + "byte skip: -1\n"), HasSubstr("it must be 0"));
  EXPECT_THAT(nrrd_error(type + "dimension: 3\nsizes: 2 1 1\nkinds: vector domain domain\n"
                                "measurement frame: (0,1) (1,0)\n"),
              HasSubstr("vectors are read only in the frame of the identity"));
}

}  // namespace
}  // namespace pulson::fields
