#include <cstdint>
#include <filesystem>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "core/paths.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "real_landmark_files.hpp"

namespace pulson::formats {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::IsEmpty;

// Real landmark files. What they hold was taken from them by other means than our reader

// clang-format off
const std::vector<RealFile> kRealFiles = {
    {"shapes_R/gorf.dat.csv", 30, 8, {5, 193}, {100, 24}, "1", "30"},
    {"shapes_R/mice_landmarks.csv", 76, 6, {168.59, 35.66}, {46.53, 135.99}, "1", "76"},
    {"shapes_R/mice_outlines.csv", 76, 60, {228, 121}, {47.9873, 142.994}, "1", "76"},
    {"shapes_R/nsa.csv", 20, 3, {214.13, 130.18}, {191.8, 113.44}, "1", "20"},
    {"shapes_R/schizophrenia.dat.csv", 28, 13, {0.345632, -0.0360314}, {0.0681437, -0.0866473}, "1", "28"},
    {"geomorph_R/plethodon.csv", 40, 12, {8.89372, 53.77644}, {15.956658, 55.595691}, "1", "40"},
    {"geomorph_R/hummingbirds.csv", 44, 25, {71, 687}, {1102, 1012}, "1", "44"},
    {"borealis_R/bombus_forewings.csv", 99, 20,
     {13.64866289489405, 2.492652071546544}, {9.04469763365469, 6.17002629272568}, "1", "99"},
    {"ktch_mosquito_csv/data_landmark_mosquito_wings.csv", 127, 18, {-0.4933, 0.013}, {-0.1473, -0.0057}, "0", "126"},
    {"momocs_R/wings.csv", 127, 18, {-0.4933, 0.013}, {-0.1473, -0.0057}, "AN1", "DE127"},
    {"bridgelandmarks/cardiac_obs0.csv", 1, 11,
     {-0.013095651515151685, -0.06487498484848486}, {-0.10466165151515167, -0.004267984848484896}},
    {"bridgelandmarks/exp1-1D_obs0.csv", 1, 3, {0.5}, {1.3}},
    {"bridgelandmarks/cardiac_obsT.csv", 14, 11,
     {-0.013095651515151685, -0.06487498484848486}, {-0.11289757575757581, -0.004253030303030203}, "1", "14"},
    {"bridgelandmarks/dgs_cc_obs0.csv", 1, 77,
     {-0.8185014665785937, -0.2872522189682315}, {-0.7689505253393623, -0.3196541449677756}},
    {"bridgelandmarks/dgs_cc_obsT.csv", 1, 77,
     {-0.74213740331752, -0.6400285257750022}, {-0.8042545739444394, -0.5419749816917468}, "1", "1"},
    {"bridgelandmarks/exp1-1D_obsT.csv", 1, 3, {1.6487212707001282}, {3.6692966676192444}, "1", "1"},
    {"bigwarp_csv/landmarks2d-blobs.csv", 2, 5, {47.5, 103.99999999999999}, {120.8125, 196}, "moving", "target"},
    {"deeplabcut/CollectedData_Mackenzie.csv", 55, 5,
     {185.25173502386923, 610.3622760638572}, {369.30799496945724, 664.0453518813204}, "img005", "img245", 0, 42},
    {"histology_birl/artificial_moving-affine.csv", 1, 12, {229, 99}, {293, 559}},
    {"histology_birl/artificial_reference.csv", 1, 12, {144, 122}, {323, 550}},
    {"histology_lung_lesion3/PS_29-041-Izd2-w35-He-les3.csv", 1, 80, {2124, 1584}, {99, 4764}},
    {"histology_lung_lesion3/PS_29-041-Izd2-w35-proSPC-4-les3.csv", 1, 80, {2498, 1948}, {406, 5348}},
    {"patternize_heliconius/BC0004_landmarks_LFW.txt", 1, 18, {178.4432, 131.6045}, {270.0942, 124.7093}},
    {"incisors_kuleuven/landmarks1-1.txt", 1, 80, {1376}, {754}, "", "", 1},
    {"incisors_kuleuven/landmarks2-1.txt", 1, 80, {1357}, {671}, "", "", 1},
    {"incisors_kuleuven/landmarks3-1.txt", 1, 80, {1442}, {672}, "", "", 1},
    {"incisors_kuleuven/landmarks4-1.txt", 1, 80, {1355}, {696}, "", "", 1},
    {"incisors_kuleuven/landmarks5-1.txt", 1, 80, {1444}, {736}, "", "", 1},
    {"incisors_kuleuven/landmarks6-1.txt", 1, 80, {1431}, {650}, "", "", 1},
    {"incisors_kuleuven/landmarks7-1.txt", 1, 80, {1379}, {668}, "", "", 1},
    {"incisors_kuleuven/landmarks8-1.txt", 1, 80, {1433}, {710}, "", "", 1},
    {"incisors_kuleuven/landmarks9-1.txt", 1, 80, {1427}, {756}, "", "", 1},
    {"incisors_kuleuven/landmarks10-1.txt", 1, 80, {1349}, {523}, "", "", 1},
    {"incisors_kuleuven/landmarks11-1.txt", 1, 80, {1322}, {666}, "", "", 1},
    {"incisors_kuleuven/landmarks12-1.txt", 1, 80, {1434}, {764}, "", "", 1},
    {"incisors_kuleuven/landmarks13-1.txt", 1, 80, {1405}, {547}, "", "", 1},
    {"incisors_kuleuven/landmarks14-1.txt", 1, 80, {1313}, {722}, "", "", 1},
    {"mlmorph_drosophila_wings/csv-example.csv", 58, 12, {290, 108}, {542, 231}, "63001.jpg", "63071.jpg"},
    {"papilionidae_butterflies/Papilionidae_landmarks.txt", 40, 1000,
     {719, 419}, {1443, 3000}, "1142369265_344_95230_Papilio_horsfieldii_HT_v_IN", "932850667_0_default"},
    {"patternize_heliconius/BC0049_landmarks_LFW.txt", 1, 18, {189.0925, 124.3115}, {287.6989, 113.2064}},
    {"regsde_landmarks/ellipse2.txt", 1, 300,
     {194.86619567871094, 32.679962158203125}, {197.68753051757812, 31.546112060546875}, "", "", 1},
    {"regsde_landmarks/wrap2.txt", 1, 300,
     {195.10527481079103, 32.86660776774089}, {200.18362869262697, 30.953979593912763}, "", "", 1},
    {"stereomorph_shapes/lm_2d_a1_v1.txt", 1, 14, {2128, 2039}, {1808, 1351}},
    {"mlmorph_drosophila_wings/tps-example.tps", 58, 12, {290, 108}, {542, 231}, "0", "57"},
    {"tps_diachlorus_wings/iz_der_leti.tps", 34, 15,
     {1.1426168530969, 4.64717485009492}, {6.89880986252452, 6.31195616164505}, "ddt10.JPG", "idt9.JPG"},
    {"tps_geomorph_course/PlethodonLand.tps", 42, 11,
     {24.5998795250387, 15.5552685496176}, {43.4934045, 15.50915205}, "P_serratus", "P_ventralis"},
    {"tps_geomorph_course/pupfish.tps", 54, 56,
     {-2.14265479162231, -4.2825124339074}, {-11.4279408341114, 1.04007746452226}, "1", "54"},
    {"tps_geomorph_course/salamanders.tps", 287, 12, {448, 2700}, {789, 2786}, "3", "310", 1},
    {"tps_geomorph_course/scallops for viz.tps", 18, 202,
     {-0.0475137786486318, -0.0527592637349552, -0.00496138825791812},
     {0.0241582426178842, -0.077981224746904, -0.0104057643190054}, "glyp02L", "sent27L"},
    {"tps_ktch/landmarks_triangle.tps", 50, 3,
     {-0.5310460885835604, -0.28026467684166556}, {0.9052972301094073, 1.1757393348118388}, "0", "49"},
    {"tps_ktch/sample_curve_data.tps", 1, 1, {150, 250}, {150, 250}, "1", "1", 2},
    {"tps_liria/triangles.tps", 5, 3, {-1, -1}, {1, 1}, "A", "E"},
    {"tps_misc/momocs_lm.tps", 2, 5, {726, 1580}, {840, 1463}, "plop", "plop2", 1},
    {"tps_misc/orthetrum_forewing.tps", 120, 20, {558, 536}, {358, 500}, "ORTALB001", "LIBDEP012"},
    {"tps_trilomorph/AMNH_28896_C.tps", 1, 16, {655, 854}, {774, 689}, "AMNH_28896", "AMNH_28896", 2},
    {"tps_trilomorph/Alberti_1983-7.87_C.tps", 1, 16,
     {2521, 1697}, {2862, 997}, "Alberti_1983-7.87", "Alberti_1983-7.87", 3},
    {"vtk_greedy_lmshoot/shooting_test_2d_target.vtk", 1, 80, {0, -1}, {-0.078459, -0.996917}},
    {"vtk_greedy_lmshoot/shooting_test_2d_template.vtk", 1, 80, {0.8, 0.3}, {0.799075, 0.292154}},
    {"vtk_skulls_skshapes/skull_australopithecus.vtk", 1, 178, {55.719101, -24.401685}, {-31.280899, 7.598315}},
    {"vtk_skulls_skshapes/skull_sapiens.vtk", 1, 206, {16.463592, -34.480583}, {-18.536408, -33.480583}},
    {"vtk_skulls_skshapes/template.vtk", 1, 150, {-105, 25}, {0, -18}},
};
// clang-format on

class RealFiles : public testing::TestWithParam<RealFile> {};

TEST_P(RealFiles, HoldWhatTheyHold) { expect_holds(GetParam()); }

INSTANTIATE_TEST_SUITE_P(Data, RealFiles, testing::ValuesIn(kRealFiles));

// The numbers of pieces are those of a union-find of the lines in another program.
TEST(RealFilesWithLines, HaveAGroupForEachPiece) {
  const std::vector<std::pair<std::string, std::size_t>> cases = {
      {"vtk_greedy_lmshoot/shooting_test_2d_target.vtk", 1},
      {"vtk_skulls_skshapes/skull_australopithecus.vtk", 6},
      {"vtk_skulls_skshapes/skull_sapiens.vtk", 6},
      {"vtk_skulls_skshapes/template.vtk", 8},
  };
  for (const auto& [name, pieces] : cases) {
    const fs::path path = data_folder() / name;
    if (!fs::exists(path)) GTEST_SKIP() << "no " << path << "; PULSON_DATA may name the folder with the data";
    EXPECT_EQ(landmarks_by_group(read_landmarks(path.string())).size(), pieces) << name;
  }
}

TEST(RealFilesOfOtherKinds, AreRefusedWithAReason) {
  const std::vector<std::pair<std::string, std::string>> cases = {
      {"shapes_R/mice_groups.csv", ":1: no coordinates in the columns 'specimen', 'group';"},
      {"shapes_R/schizophrenia_groups.csv", ":1: no coordinates in the columns 'specimen', 'group';"},
      {"geomorph_R/plethodon_groups.csv", ":1: no coordinates in the columns 'specimen', 'species', 'site';"},
      {"geomorph_R/hummingbirds_curvepts.csv", ":1: no coordinates in the columns 'before', 'slide', 'after';"},
      {"borealis_R/bombus_metadata.csv", ":1: no coordinates in the columns"},
      {"ktch_mosquito_csv/meta_landmark_mosquito_wings.csv", ":1: no coordinates in the columns"},
      {"1d_age_depth/MSB2K.csv", ":1: no coordinates in the columns 'labID', 'age', 'error', 'depth';"},
  };
  int seen = 0;
  for (const auto& [name, reason] : cases) {
    const fs::path path = data_folder() / name;
    if (!fs::exists(path)) continue;
    ++seen;
    try {
      read_landmark_file(path);
      ADD_FAILURE() << name << " was read";
    } catch (const InputError& error) {
      EXPECT_THAT(error.what(), HasSubstr(name + reason));
    }
  }
  if (seen == 0) GTEST_SKIP() << "no data in " << data_folder() << "; PULSON_DATA may name the folder";
}

// None of these files is of a program that annotates pictures, nor of those with a format of their own below.
TEST(RealFilesOfOtherFormats, AreNotTaken) {
  const std::set<std::string> others = {"npz",  "roi",  "coco",    "openpose", "via",  "geojson",
                                        "cvat", "fiji", "meshlab", "amira",    "cmtk", "via.csv"};
  if (!fs::exists(data_folder())) GTEST_SKIP() << "no data in " << data_folder() << "; PULSON_DATA may name the folder";
  constexpr std::uintmax_t kLargest = 4U << 20U;
  int seen = 0;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(data_folder())) {
    if (!entry.is_regular_file() || entry.file_size() > kLargest) continue;
    const std::string text = read_file(entry.path());
    ++seen;
    for (const LandmarkFormat& format : landmark_formats())
      if (others.contains(format.name)) {
        EXPECT_FALSE(format.sniff(text)) << entry.path() << " by " << format.name;
      }
  }
  EXPECT_GT(seen, 100);
}

TEST(SampleShapes, ComeInPairsThatMatch) {
  const fs::path folder = fs::path(PULSON_SOURCE_DIR) / "sample_shapes";
  int pairs = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const std::size_t ending = name.find("_source.csv");
    if (ending == std::string::npos) continue;
    std::vector<std::string> warnings;
    const Landmarks source = read_landmarks(entry.path().string(), &warnings);
    const Landmarks target = read_landmarks((folder / (name.substr(0, ending) + "_target.csv")).string(), &warnings);
    EXPECT_EQ(source.count(), target.count()) << name;
    EXPECT_EQ(source.dimension(), target.dimension()) << name;
    EXPECT_EQ(source.groups, target.groups) << name;
    EXPECT_FALSE(find_coincident(source.points, 1e-3)) << name;
    EXPECT_FALSE(find_coincident(target.points, 1e-3)) << name;
    EXPECT_THAT(warnings, IsEmpty()) << name;
    ++pairs;
  }
  EXPECT_EQ(pairs, 7);
}

}  // namespace
}  // namespace pulson::formats
