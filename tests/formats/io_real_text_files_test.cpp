#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pulson/formats/landmark_files.hpp"
#include "real_landmark_files.hpp"

namespace pulson::formats {
namespace {

using testing::ElementsAre;

// Real files of text formats. What they hold was taken from them by other means than our readers

// clang-format off
const std::vector<RealFile> kRealTextFiles = {
    {"elastix_points/CT_3D_lung_fixed_point_set.txt", 1, 100, {-36.351, -36.974, -1204.5}, {55.171, -6.922, -1299.5}},
    {"elastix_points/CT_3D_lung_moving_point_set.txt", 1, 100, {-40.94, -47.022, -1169.5}, {51.265, -19.702, -1272}},
    {"elastix_points/fixed_point_set_test.txt", 1, 5, {25, 25}, {50, 50}},
    {"histology_birl/artificial_moving-affine.pts", 1, 12, {229, 99}, {293, 559}},
    {"histology_birl/artificial_reference.pts", 1, 12, {144, 122}, {323, 550}},
    {"nts_morphologika/RATS.nts", 164, 8, {-0.45, -0.475}, {-0.45, -0.595}, "RATS#1", "RATS#164"},
    {"nts_morphologika/adc1.nts", 1, 15, {0.930923269486495, 10.3010780379813}, {6.65230061907654, 6.9276244120438}},
    {"edma_xyz/apert_ALLAPT4.xyz", 5, 10, {-4.5591, -1.9514}, {9.641, -3.2855}, "apert_ALLAPT4#1", "apert_ALLAPT4#5"},
    {"stereomorph_shapes/mug_001.txt", 1, 8, {1041, 324}, {1943, 1248}},
};
// clang-format on

class RealTextFiles : public testing::TestWithParam<RealFile> {};

TEST_P(RealTextFiles, HoldWhatTheyHold) { expect_holds(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Data, RealTextFiles, testing::ValuesIn(kRealTextFiles));

LandmarkFile read_real(const std::string& name) {
  const std::filesystem::path path = data_folder() / name;
  return std::filesystem::exists(path) ? read_landmark_file(path) : LandmarkFile{};
}

TEST(RealTpsFiles, KeepCurvesAndScale) {
  const LandmarkFile file = read_real("tps_trilomorph/AMNH_28896_C.tps");
  if (file.shapes.empty()) GTEST_SKIP() << "no data in " << data_folder();
  const Landmarks& shape = file.shapes.front();
  ASSERT_EQ(shape.curves.size(), 4U);
  for (const Points& curve : shape.curves) EXPECT_EQ(curve.cols(), 30);
  EXPECT_EQ(shape.curves.front().col(0), Eigen::Vector2d(656, 855));
  EXPECT_EQ(shape.image, "Eldredgeops.png");
  EXPECT_EQ(shape.scale, 0.104165);
}

TEST(RealEdmaFiles, HaveLabels) {
  const LandmarkFile file = read_real("edma_xyz/apert_ALLAPT4.xyz");
  if (file.shapes.empty()) GTEST_SKIP() << "no data in " << data_folder();
  for (const Landmarks& shape : file.shapes)
    EXPECT_THAT(shape.labels, ElementsAre("NAS", "NSL", "ANS", "IDS", "PNS", "TSE", "SEL", "PSE", "BAS", "IOP"));
}

TEST(RealStereomorphFiles, KeepLabelsAndScale) {
  const LandmarkFile file = read_real("stereomorph_shapes/mug_001.txt");
  if (file.shapes.empty()) GTEST_SKIP() << "no data in " << data_folder();
  const Landmarks& shape = file.shapes.front();
  EXPECT_EQ(shape.labels.front(), "Handle_Cup_Out_Top");
  EXPECT_EQ(shape.labels.back(), "Cup_Base_Opposite");
  EXPECT_EQ(shape.scale, 0.00840289777679458);
  EXPECT_EQ(shape.properties.size(), 7U);
}

}  // namespace
}  // namespace pulson::formats
