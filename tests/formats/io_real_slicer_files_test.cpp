#include <string>
#include <utility>
#include <vector>

#include <gtest/gtest.h>

#include "real_landmark_files.hpp"

namespace pulson::formats {
namespace {

// Real files of 3D Slicer and numpy. What they hold was taken from them by other means than our reader

// clang-format off
const std::vector<RealFile> kRealSlicerFiles = {
    {"slicer_fcsv/SCP1_Endo.fcsv", 1, 5, {128.019, 125.141, 26.192}, {109.008, 105.572, 17.332}},
    {"slicer_fcsv/tpl-Agile12v2016_afids.fcsv", 1, 32,
     {4.1493909375, 5.678821875, 1.4795320625}, {-6.7836909375, 22.16438125, -0.05127345}},
    {"slicer_fcsv/tpl-Colin27_afids.fcsv", 1, 32,
     {0.547527528125, 4.007721875, -5.85731125}, {-13.322734375, 21.3597625, -12.51313125}},
    {"slicer_fcsv/tpl-MNI2009cAsym_afids.fcsv", 1, 32,
     {-0.204861407692308, 2.72288076923077, -4.88105282051282},
     {-13.3650815789474, 17.0294973684211, -13.0638105263158}},
    {"slicer_mrkjson/A_J.mrk.json", 1, 51, {-9.21016, -25.0792, 9.31477}, {-9.26069, -6.18676, 3.75091}},
    {"slicer_mrkjson/C57BL6_J.mrk.json", 1, 51, {-9.34125, -24.6415, 9.81161}, {-9.38217, -6.56751, 3.87006}},
    {"bridgelandmarks/cardiac.npy", 14, 66,
     {-0.013095651515151685, -0.06487498484848486}, {-0.027212575757575852, -0.1029680303030302},
     "cardiac#1", "cardiac#14"},
};
// clang-format on

class RealSlicerFiles : public testing::TestWithParam<RealFile> {};

TEST_P(RealSlicerFiles, HoldWhatTheyHold) { expect_holds(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Data, RealSlicerFiles, testing::ValuesIn(kRealSlicerFiles));

TEST(RealSlicerAxes, AreThoseOfTheFile) {
  const std::vector<std::pair<std::string, std::string>> cases = {{"slicer_fcsv/SCP1_Endo.fcsv", "RAS"},
                                                                  {"slicer_mrkjson/A_J.mrk.json", "LPS"}};
  for (const auto& [name, axes] : cases) {
    const std::filesystem::path path = data_folder() / name;
    if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path << "; PULSON_DATA may name the folder";
    const LandmarkFile file = read_landmark_file(path);
    EXPECT_EQ(file.axes, axes) << name;
    EXPECT_EQ(file.units, "mm") << name;
    EXPECT_EQ(file.shapes[0].labels[0], axes == "RAS" ? "SCP1_Endo-1" : "1");
  }
}

}  // namespace
}  // namespace pulson::formats
