#include <cmath>

#include "fuzz_targets.hpp"
#include "fuzzing.hpp"
#include "landmark_laws.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::fuzz {

bool landmark_files(std::string_view input) {
  const MemoryFile bytes(input);
  const auto file = attempt([&] { return formats::read_landmark_file(bytes.path()); });
  if (!file) return true;
  check_landmark_file(*file);
  check_writers(*file);
  const auto negative_is_missing = formats::ReadOptions{.negative_is_missing = true};
  demand("coordinates at zero", [&] { return formats::read_landmark_file(bytes.path(), {.zero_is_missing = true}); });
  demand("negative coordinates", [&] { return read_landmark_file(bytes.path(), negative_is_missing); });
  attempt([&] { return formats::read_landmarks(bytes.path() + "#1"); });
  for (const formats::ReadOptions& options :
       {formats::ReadOptions{.columns = {{"x", "a"}, {"name", "b"}}, .dimension = 2},
        formats::ReadOptions{.landmarks = "2,1", .applies_scale = true},
        formats::ReadOptions{
            .missing_codes = {0}, .absent_codes = {std::nan("")}, .landmarks = "1", .curve_points = 3}})
    if (const auto read = attempt([&] { return read_landmark_file(bytes.path(), options); }))
      check_landmark_file(*read);
  return true;
}

bool point_lists(std::string_view input) {
  return read_as_row(input, {"tps", "ibug", "elastix", "transformix", "dlib", "idav", "nts", "morphologika", "edma",
                             "stereomorph", "fcsv", "cvat", "fiji", "meshlab", "amira", "cmtk"});
}

bool arrays(std::string_view input) { return read_as_row(input, {"vtk", "npy", "npz", "roi"}); }

bool json_landmarks(std::string_view input) {
  return read_as_row(input, {"json", "mrk.json", "labelme", "menpo", "coco", "openpose", "via", "geojson"});
}

namespace {

constexpr std::string_view kWeights = "weights\n";
constexpr std::string_view kCovariances = "covariances\n";
constexpr int kRows = 3;

Landmarks rows_in(int dimension) {
  Landmarks shape;
  shape.points.setZero(dimension, kRows);
  return shape;
}

bool weights(std::string_view text) {
  const MemoryFile file(text);
  const auto numbers = attempt([&] { return formats::read_weights(file.path(), rows_in(2)); });
  if (!numbers) return true;
  require(numbers->size() == kRows && numbers->allFinite() && (numbers->array() >= 0).all(), "weights");
  return true;
}

bool covariances(std::string_view text) {
  const MemoryFile file(text);
  for (int d = 1; d <= 3; ++d) {
    const auto matrices = attempt([&] { return formats::read_covariances(file.path(), rows_in(d)); });
    if (!matrices) continue;
    require(matrices->size() == kRows, "covariances are not as many as landmarks");
    for (const Eigen::MatrixXd& matrix : *matrices)
      require(matrix.rows() == d && matrix.cols() == d && matrix.allFinite() && matrix == matrix.transpose(),
              "a covariance is not symmetric");
  }
  return true;
}

}  // namespace

bool tables(std::string_view input) {
  if (input.starts_with(kWeights)) return weights(input.substr(kWeights.size()));
  if (input.starts_with(kCovariances)) return covariances(input.substr(kCovariances.size()));
  return read_as_row(input, {"csv", "deeplabcut", "bigwarp", "via.csv"});
}

}  // namespace pulson::fuzz
