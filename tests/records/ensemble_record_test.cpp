// The texts of an ensemble's results, and numpy's format.

#include <cmath>
#include <cstring>
#include <map>
#include <sstream>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "ensemble_examples.hpp"
#include "ensemble_runs.hpp"
#include "lines_of.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "temporary_folder.hpp"

namespace pulson::records {
namespace {

using testing::HasSubstr;
using testing::StartsWith;
using Json = nlohmann::ordered_json;

std::vector<std::string> fields_of(const std::string& line) {
  std::istringstream stream(line);
  std::vector<std::string> fields;
  for (std::string field; std::getline(stream, field, ',');) fields.push_back(field);
  if (line.ends_with(',')) fields.emplace_back();
  return fields;
}

/// [time][landmark][axis]
void expect_shape(const Json& json, std::size_t times, std::size_t landmarks, std::size_t axes, bool numbers) {
  ASSERT_EQ(json.size(), times);
  for (const Json& at_time : json) {
    ASSERT_EQ(at_time.size(), landmarks);
    for (const Json& of_landmark : at_time) {
      ASSERT_EQ(of_landmark.size(), axes);
      for (const Json& value : of_landmark) EXPECT_TRUE(numbers ? value.is_number() : value.is_null());
    }
  }
}

TEST(EnsembleJson, HasEveryKeyOfTheInterface) {
  const EnsembleRun run = finished_run(line_example());
  const Json json = Json::parse(ensemble_json(run));
  for (const char* key : {"samples",    "seed",    "dt",
                          "time",       "threads", "seconds",
                          "crossing",   "paths",   "momentum_error_max",
                          "times",      "mean_q",  "mean_p",
                          "partial",    "kernel",  "noise",
                          "integrator", "steps",   "q",
                          "p",          "error_q", "deviation_p"})
    EXPECT_TRUE(json.contains(key)) << key;
  EXPECT_EQ(json["samples"], 100);
  EXPECT_EQ(json["samples_wanted"], 100);
  EXPECT_EQ(json["partial"], false);
  EXPECT_EQ(json["seed"], std::uint64_t{18446744073709551557U});
  EXPECT_EQ(json["dt"], 0.02);
  EXPECT_EQ(json["steps"], 100);
  EXPECT_EQ(json["time"], 2);
  EXPECT_EQ(json["threads"], 2);
  EXPECT_EQ(json["seconds"], 1.5);
  EXPECT_EQ(json["noise"], "ch-sd:beta=1.5,on=2");
  EXPECT_EQ(json["q"], Json::parse("[[0.0],[3.0]]"));
  EXPECT_EQ(json["p"], Json::parse("[[4.0],[1.0]]"));
  const Estimate crossing = run.sums.crossing_probability();
  EXPECT_EQ(json["crossing"]["probability"], crossing.value);
  EXPECT_EQ(json["crossing"]["standard_error"], crossing.standard_error);
  EXPECT_EQ(json["crossing"]["ever"], static_cast<double>(run.sums.crossing.ever) / 100);
  EXPECT_GT(json["crossing"]["ever"], 0);
  EXPECT_EQ(json["paths"], Json::parse(R"({"clean": 100, "no_root": 0, "momentum_bound": 0, "tie": 0})"));
  EXPECT_EQ(json["momentum_error_max"], run.sums.momentum_error);
  EXPECT_EQ(json["times"], Json::parse("[0.0, 0.5, 2.0]"));
  EXPECT_EQ(json["counts"], Json::parse("[100, 100, 100]"));
  for (const char* key : {"mean_q", "mean_p", "error_q", "error_p", "deviation_q", "deviation_p"})
    expect_shape(json[key], 3, 2, 1, true);
  EXPECT_EQ(json["mean_q"][1][1][0], run.sums.moments[1].mean[1]);
  EXPECT_EQ(json["mean_p"][2][0][0], run.sums.moments[2].mean[2]);
  EXPECT_EQ(json["error_p"][2][1][0], run.sums.mean_error(2)[3]);
  EXPECT_EQ(json["deviation_q"][2][1][0], std::sqrt(run.sums.moments[2].variance()[1]));
}

TEST(EnsembleJson, HasShapesOfThePlaneAndNoCrossingThere) {
  const EnsembleRun run = finished_run(plane_example());
  const Json json = Json::parse(ensemble_json(run));
  EXPECT_TRUE(json["crossing"].is_null());
  for (const char* key : {"mean_q", "mean_p", "error_q", "error_p", "deviation_q", "deviation_p"})
    expect_shape(json[key], 2, 3, 2, true);
  for (std::size_t a = 0; a < 3; ++a)
    for (std::size_t axis = 0; axis < 2; ++axis) {
      const auto i = static_cast<Eigen::Index>(2 * a + axis);
      EXPECT_EQ(json["mean_q"][1][a][axis], run.sums.moments[1].mean[i]);
      EXPECT_EQ(json["mean_p"][1][a][axis], run.sums.moments[1].mean[6 + i]);
      EXPECT_EQ(json["q"][a][axis], run.start.q(static_cast<Eigen::Index>(axis), static_cast<Eigen::Index>(a)));
    }
}

TEST(EnsembleJson, HasNullWhereNothingIsDefined) {
  EnsembleExample one = line_example();
  one.options.samples = 1;
  Json json = Json::parse(ensemble_json(finished_run(one)));
  for (const char* key : {"error_q", "error_p", "deviation_q", "deviation_p"}) expect_shape(json[key], 3, 2, 1, false);
  expect_shape(json["mean_q"], 3, 2, 1, true);
  EnsembleExample single{.start = {Points::Zero(1, 1), Points::Ones(1, 1)}};
  single.noise = "ch-sd:beta=1";
  single.options = line_example().options;
  EXPECT_TRUE(Json::parse(ensemble_json(finished_run(single)))["crossing"].is_null());
  EnsembleExample lost = line_example();
  lost.options.momentum_bound = 3;  // they begin beyond it
  json = Json::parse(ensemble_json(finished_run(lost)));
  EXPECT_TRUE(json["crossing"].is_null());
  EXPECT_EQ(json["paths"]["momentum_bound"], 100);
  EXPECT_EQ(json["times"], Json::array());
  EXPECT_EQ(json["mean_q"], Json::array());
}

TEST(EnsembleJson, TellsWhatIsPartial) {
  EnsembleRun run = finished_run(line_example());
  run.options.samples = 200;
  const Json json = Json::parse(ensemble_json(run));
  EXPECT_EQ(json["partial"], true);
  EXPECT_EQ(json["samples"], 100);
  EXPECT_EQ(json["samples_wanted"], 200);
}

TEST(EnsembleMeansCsv, HasARowForEachTimeAndCoordinate) {
  const EnsembleRun run = finished_run(plane_example());
  const std::vector<std::string> lines = lines_of(ensemble_means_csv(run));
  ASSERT_EQ(lines.size(), 1 + 2 * 12U);
  EXPECT_EQ(lines[0], "time,landmark,quantity,axis,mean,standard_error,standard_deviation,q05,q25,q50,q75,q95");
  EXPECT_THAT(lines[1], StartsWith("0,1,q,x,"));
  EXPECT_THAT(lines[2], StartsWith("0,1,q,y,"));
  EXPECT_THAT(lines[7], StartsWith("0,1,p,x,"));
  EXPECT_THAT(lines[24], StartsWith("2,3,p,y,"));
  for (std::size_t row = 1; row < lines.size(); ++row) {
    const std::vector<std::string> fields = fields_of(lines[row]);
    ASSERT_EQ(fields.size(), 12U) << lines[row];
    const std::size_t record = (row - 1) / 12;
    const auto i = static_cast<Eigen::Index>((row - 1) % 12);
    EXPECT_EQ(std::stod(fields[4]), run.sums.moments[record].mean[i]);
    EXPECT_EQ(std::stod(fields[5]), run.sums.mean_error(record)[i]);
    EXPECT_EQ(std::stod(fields[6]), std::sqrt(run.sums.moments[record].variance()[i]));
    for (std::size_t k = 7; k < 12; ++k) {
      if (record == 0) {
        EXPECT_EQ(fields[k], "") << "no histogram there";
        continue;
      }
      EXPECT_EQ(std::stod(fields[k]), run.sums.histograms[1][static_cast<std::size_t>(i)].quantile(
                                          std::vector<double>{0.05, 0.25, 0.5, 0.75, 0.95}[k - 7]));
    }
  }
}

TEST(EnsembleDensitiesCsv, IntegratesToOne) {
  EnsembleRun run = finished_run(line_example());
  const std::vector<std::string> lines = lines_of(ensemble_densities_csv(run));
  EXPECT_EQ(lines[0], "time,landmark,quantity,axis,low,high,density");
  std::map<std::string, double> integrals;
  for (std::size_t row = 1; row < lines.size(); ++row) {
    const std::vector<std::string> fields = fields_of(lines[row]);
    ASSERT_EQ(fields.size(), 7U);
    const double low = std::stod(fields[4]);
    const double high = std::stod(fields[5]);
    EXPECT_LT(low, high);
    EXPECT_GT(std::stod(fields[6]), 0);
    integrals[fields[0] + fields[1] + fields[2] + fields[3]] += std::stod(fields[6]) * (high - low);
  }
  EXPECT_EQ(integrals.size(), 2 * 4U);  // two times are asked for
  for (const auto& [place, integral] : integrals) EXPECT_NEAR(integral, 1, 1e-6) << place;
  std::size_t filled = 0;
  for (const std::size_t record : {1U, 2U})
    for (const ensemble::Histogram& h : run.sums.histograms[record])
      filled += static_cast<std::size_t>(std::count_if(h.counts.begin(), h.counts.end(), [](auto n) { return n > 0; }));
  EXPECT_EQ(lines.size(), 1 + filled);
  run.densities = {100};
  EXPECT_THAT(ensemble_densities_csv(run), testing::Not(HasSubstr("\n0.5,")));
}

class Npy : public InTemporaryFolder {};

TEST_F(Npy, IsNumpysFormatOfVersionOne) {
  std::vector<double> numbers(24);
  for (std::size_t i = 0; i < 24; ++i) numbers[i] = 0.1 * static_cast<double>(i) - 1;
  numbers[5] = std::nan("");
  for (const std::vector<std::size_t>& shape :
       std::vector<std::vector<std::size_t>>{{24}, {2, 12}, {2, 3, 4}, {1, 2, 3, 2, 2}}) {
    formats::write_npy("x.npy", numbers, shape);
    const std::string file = contents("x.npy");
    ASSERT_GT(file.size(), 64U);
    EXPECT_EQ(file.substr(0, 8), std::string("\x93NUMPY\x01\x00", 8));
    const std::size_t size = static_cast<unsigned char>(file[8]) + 256U * static_cast<unsigned char>(file[9]);
    EXPECT_EQ((10 + size) % 64, 0U);
    const std::string header = file.substr(10, size);
    EXPECT_TRUE(header.ends_with('\n'));
    EXPECT_THAT(header, StartsWith("{'descr': '<f8', 'fortran_order': False, 'shape': ("));
    std::string tuple;
    for (const std::size_t n : shape) tuple += (tuple.empty() ? "" : ", ") + std::to_string(n);
    EXPECT_THAT(header, HasSubstr("(" + tuple + ",)"));
    ASSERT_EQ(file.size(), 10 + size + 24 * 8);
    EXPECT_EQ(std::memcmp(file.data() + 10 + size, numbers.data(), 24 * 8), 0);
  }
}

TEST_F(Npy, HoldsNoNumbersToo) {
  formats::write_npy("none.npy", {}, {0, 4});
  const std::string file = contents("none.npy");
  EXPECT_EQ(file.size() % 64, 0U);
  EXPECT_THAT(file, HasSubstr("(0, 4,)"));
  EXPECT_THAT(error_of([] { formats::write_npy("nowhere/x.npy", {}, {0}); }), HasSubstr("nowhere"));
}

}  // namespace
}  // namespace pulson::records
