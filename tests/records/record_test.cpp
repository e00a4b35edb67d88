#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "combinations.hpp"
#include "lines_of.hpp"
#include "plain_options.hpp"
#include "pulson/records/records.hpp"
#include "shape.hpp"
#include "temporary_folder.hpp"

namespace pulson::records {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using Json = nlohmann::ordered_json;

// A registration in d dimensions in which nothing is trivial: noise, alignment, labels, groups.
matching::Registration example(int d, const std::string& noise = "ch-sd:beta=0.5,on=1/3") {
  Numbers numbers(static_cast<unsigned>(d));
  Landmarks source;
  source.points = numbers.landmarks(d, 4);
  source.labels = {"tip", "left \"inner\", 2", "",
                   "\xc3\xa4u\xc3\x9f"
                   "eres"};
  source.groups = {"a", "a", "b", "b"};
  source.name = "specimen 7";
  source.source = "shapes.tps#7";
  Landmarks target = source;
  target.points = 2 * source.points + 0.3 * numbers(d, 4);
  target.source = "other.csv";
  matching::RegistrationOptions options = plain_options();
  options.noise = noise;
  options.grid = {0.7, 6};
  options.lambda.reset();
  options.align = AlignmentKind::kSimilarity;
  return register_shapes(source, target, options);
}

class Record : public InTemporaryFolder {
 protected:
  static matching::Registration reread(const matching::Registration& registration) {
    write("registration.json", registration_json(registration, {}));
    return read_registration("registration.json");
  }

  // The error of reading the record of `example(2)` after `damage` to it.
  static std::string error_after(const std::function<void(Json&)>& damage) {
    Json json = Json::parse(registration_json(example(2), {}));
    damage(json);
    write("registration.json", json.dump());
    return error_of([] { read_registration("registration.json"); });
  }
};

TEST_F(Record, IsReadBackAndReplayedToTheSameBits) {
  for (int d = 1; d <= 3; ++d) {
    for (const std::string& noise : noise_specs()) {
      SCOPED_TRACE(noise + " in dimension " + std::to_string(d));
      const matching::Registration written = example(d, noise);
      const matching::Registration back = reread(written);
      const TopologyCounts counts{d == 1 ? std::optional(3) : std::nullopt, d == 2 ? std::optional(1) : std::nullopt};
      EXPECT_EQ(registration_json(back, {counts}), registration_json(written, {counts}));
      EXPECT_EQ(back.source.points, written.source.points);
      EXPECT_EQ(back.original.points, written.original.points);
      EXPECT_EQ(back.target.points, written.target.points);
      EXPECT_EQ(back.original.labels, written.original.labels);
      EXPECT_EQ(back.original.groups, written.original.groups);
      EXPECT_EQ(back.original.source, "shapes.tps#7");
      EXPECT_EQ(back.target.source, "other.csv");
      EXPECT_EQ(back.alignment.apply(back.original.points), written.source.points);
      const Trajectory path = replay(back);
      EXPECT_EQ(path.final().q, written.result);
      const Trajectory expected = replay(written);
      for (std::size_t k = 0; k < expected.states.size(); ++k) {
        EXPECT_EQ(path.states[k].q, expected.states[k].q);
        EXPECT_EQ(path.states[k].p, expected.states[k].p);
      }
    }
  }
}

// A circle, and the same as a band that is bent to a whole turn. @return 2×12
Points bent_circle(bool is_bent) {
  constexpr double kPi = std::numbers::pi;
  Points points(2, 12);
  for (int a = 0; a < 12; ++a) {
    const double x = std::cos(kPi * a / 6), y = std::sin(kPi * a / 6), angle = kPi - 2 * std::asin(y);
    points.col(a) = is_bent ? Eigen::Vector2d((0.8 - 0.3 * x) * std::cos(angle), (0.8 - 0.3 * x) * std::sin(angle))
                            : Eigen::Vector2d(x, y);
  }
  return points;
}

// Of a path whose p0 amplifies errors so much that a shot leaves it.
TEST_F(Record, KeepsTheStatesOfAPathThatAShotLeaves) {
  const Landmarks source = shape(bent_circle(false));
  matching::RegistrationOptions options = plain_options();
  options.kernel = "gaussian:alpha=0.6";
  options.sigma = 0.002;
  options.grid.steps = 20;
  const matching::Registration written = register_shapes(source, shape(bent_circle(true)), options);
  ASSERT_EQ(written.states.size(), 21);
  EXPECT_EQ(written.integrator, "midpoint");
  EXPECT_EQ(written.states.front().q, source.points);
  EXPECT_EQ(written.states.back().q, written.result);
  EXPECT_EQ(written.states.front().p, written.momenta);
  const matching::Registration back = reread(written);
  ASSERT_EQ(back.states.size(), 21);
  const Trajectory path = replay(back);
  for (std::size_t k = 0; k < path.states.size(); ++k) {
    EXPECT_EQ(path.states[k].q, written.states[k].q);
    EXPECT_EQ(path.states[k].p, written.states[k].p);
  }
  EXPECT_TRUE(register_shapes(source, shape(1.1 * source.points), options).states.empty());

  Json json = Json::parse(registration_json(written, {}));
  json["states"]["positions"].erase(3);
  write("cut.json", json.dump());
  EXPECT_THAT(error_of([] { read_registration("cut.json"); }), HasSubstr("states"));
}

TEST_F(Record, NamesChannelsByTheNumbersOfTheirLandmarksAndByTheirFields) {
  matching::Registration fit =
      example(2, "potential:beta=1,gamma=2+p-sd:beta=3,fields=bump,center=0.5/0.25,width=4+p-sd:beta=1,fields=cos");
  fit.source.numbers = {2, 3, 5, 7};
  const Json channels = Json::parse(registration_json(fit, {}))["channels"];
  ASSERT_EQ(channels.size(), 6U + 2 + 4);
  EXPECT_EQ(channels[2].dump(), R"({"noise":"potential:beta=1,gamma=2","landmark":[3,5]})");
  EXPECT_EQ(channels[7].dump(),
            R"({"noise":"p-sd:beta=3,fields=bump,center=0.5/0.25,width=4","axis":2,"center":[0.5,0.25]})");
  EXPECT_EQ(channels[10].dump(), R"({"noise":"p-sd:beta=1,fields=cos,wavenumber=1","axis":1,"wavevector":[0.0,1.0]})");
}

TEST_F(Record, HasEveryKeyOfTheInterface) {
  const matching::Registration fit = example(2);
  const Json json = Json::parse(registration_json(fit, {std::nullopt, 2}));
  for (const char* key : {"kernel",   "noise",      "mode",         "integrator",       "steps",
                          "time",     "sigma",      "lambda",       "converged",        "iterations",
                          "seconds",  "rms",        "max_residual", "source",           "target",
                          "result",   "momenta",    "increments",   "order_inversions", "flipped_triangles",
                          "channels", "step_error", "amplification"})
    EXPECT_TRUE(json.contains(key)) << key;
  EXPECT_EQ(json["kernel"], fit.kernel);
  EXPECT_EQ(json["noise"], "ch-sd:beta=0.5,on=1/3");
  EXPECT_EQ(json["mode"], "metamorphosis");
  EXPECT_EQ(json["steps"], 6);
  EXPECT_EQ(json["time"], 0.7);
  EXPECT_EQ(json["rms"], fit.rms());
  EXPECT_EQ(json["max_residual"], fit.max_residual());
  EXPECT_EQ(json["cost"]["total"], fit.cost.total());
  EXPECT_EQ(json["cost"]["energy"], fit.cost.energy);
  EXPECT_EQ(json["cost"]["action"], fit.cost.action);
  EXPECT_EQ(json["cost"]["data"], fit.cost.data);
  EXPECT_EQ(json["step_error"]["rms"], fit.step_error->rms);
  EXPECT_EQ(json["step_error"]["cost"], fit.step_error->cost);
  EXPECT_EQ(json["amplification"], *fit.amplification);
  EXPECT_EQ(json["order_inversions"], nullptr);
  EXPECT_EQ(json["flipped_triangles"], 2);
  EXPECT_EQ(json["momenta"].size(), 4U);  // landmarks
  EXPECT_EQ(json["momenta"][3][1], fit.momenta(1, 3));
  EXPECT_EQ(json["increments"].size(), 6U);     // steps
  EXPECT_EQ(json["increments"][5].size(), 4U);  // channels: two landmarks, two axes
  EXPECT_EQ(json["increments"][5][2], fit.increments(2, 5));
  EXPECT_EQ(json["channels"].dump(), R"([{"noise":"ch-sd:beta=0.5,on=1/3","landmark":1,"axis":1},)"
                                     R"({"noise":"ch-sd:beta=0.5,on=1/3","landmark":1,"axis":2},)"
                                     R"({"noise":"ch-sd:beta=0.5,on=1/3","landmark":3,"axis":1},)"
                                     R"({"noise":"ch-sd:beta=0.5,on=1/3","landmark":3,"axis":2}])");
}

TEST_F(Record, EveryMissingKeyIsNamed) {
  const Json whole = Json::parse(registration_json(example(2), {}));
  // What can be computed again from the rest is not needed for reading.
  // Old records have no "data" and end before "unknowns"; without "states" the momenta are shot.
  const std::vector<std::string> derived = {"format",
                                            "version",
                                            "matched",
                                            "rms",
                                            "initial_rms",
                                            "original_rms",
                                            "max_residual",
                                            "order_inversions",
                                            "flipped_triangles",
                                            "shares",
                                            "data",
                                            "unknowns",
                                            "step_error",
                                            "amplification",
                                            "channels",
                                            "minima",
                                            "states",
                                            "frame",
                                            "verdicts",
                                            "prediction",
                                            "concentrated",
                                            "target_topology"};
  for (const auto& [key, value] : whole.items()) {
    const std::string error = error_after([&key = key](Json& json) { json.erase(key); });
    if (std::find(derived.begin(), derived.end(), key) != derived.end())
      EXPECT_EQ(error, "no error") << key;
    else
      EXPECT_EQ(error, "registration.json: '" + key + "' is missing");
  }
  EXPECT_EQ(error_after([](Json& json) { json["cost"].erase("action"); }),
            "registration.json: 'cost.action' is missing");
}

TEST_F(Record, WrongTypesAndValuesNameFileAndKey) {
  const auto expect_named = [](const std::string& key, const std::vector<Json>& values) {
    for (const Json& value : values) {
      const std::string error = error_after([&](Json& json) { json[key] = value; });
      EXPECT_THAT(error, AllOf(HasSubstr("registration.json: "), HasSubstr("'" + key))) << value;
    }
  };
  for (const char* key : {"kernel", "noise", "mode", "integrator", "solver", "stop_reason"})
    expect_named(key, {3, nullptr});
  for (const char* key : {"time", "sigma", "lambda", "seconds", "relative_gradient"})
    expect_named(key, {"1", nullptr, true});
  for (const char* key : {"source", "target", "original", "result", "momenta", "increments"})
    expect_named(key, {1, {{"a", "b"}}, {1, 2}, nullptr});
  expect_named("converged", {1, "yes"});
  for (const char* key : {"steps", "iterations", "evaluations"}) expect_named(key, {"6", 6.5, true, 1e300});
  expect_named("alignment", {1, {{"kind", 1}}});
  expect_named("mode", {"mapp"});
  expect_named("solver", {"adam"});
  expect_named("kernel", {"gausian:alpha=1", "gaussian:alpha=-1"});
  expect_named("noise", {"chsd:beta=1", "ch-sd:beta=0.5,on=1/9"});
  expect_named("integrator", {"euler"});
  expect_named("seed", {-1, 1.5, 1e300, "1"});
  for (const char* key : {"kernel", "noise", "mode", "integrator", "solver"}) expect_named(key, {"a\nb", "a:b\r=1"});
}

TEST_F(Record, WrongSizesNameFileAndKey) {
  for (const char* key : {"source", "target", "original", "result", "momenta", "increments"}) {
    EXPECT_THAT(error_after([&](Json& json) { json[key].erase(0); }), HasSubstr("registration.json: '")) << key;
    EXPECT_THAT(error_after([&](Json& json) { json[key][1].erase(0); }),
                AllOf(HasSubstr("registration.json: '" + std::string(key) + "' has"), HasSubstr("row 2")));
    EXPECT_THAT(error_after([&](Json& json) { json[key] = Json::array(); }), HasSubstr("registration.json: '")) << key;
  }
  EXPECT_THAT(error_after([](Json& json) { json["steps"] = 5; }), HasSubstr("'increments'"));
  EXPECT_THAT(error_after([](Json& json) { json["source_shape"]["labels"].erase(0); }),
              HasSubstr("source_shape.labels"));
  EXPECT_THAT(error_after([](Json& json) { json["target_shape"]["groups"].erase(0); }),
              HasSubstr("target_shape.groups"));
  EXPECT_THAT(error_after([](Json& json) { json["alignment"]["translation"].erase(0); }), HasSubstr("alignment."));
  EXPECT_THAT(error_after([](Json& json) { json["alignment"]["linear"].erase(0); }), HasSubstr("alignment.linear"));
}

TEST_F(Record, AlignmentOfAnOldRecordIsRead) {
  const matching::Registration written = example(2);
  Json json = Json::parse(registration_json(written, {}));
  Json& alignment = json["alignment"];
  alignment["rotation"] = alignment["linear"];
  alignment.erase("linear");
  write("registration.json", json.dump());
  EXPECT_EQ(read_registration("registration.json").alignment.linear, written.alignment.linear);
  EXPECT_EQ(error_after([](Json& damaged) { damaged["alignment"].erase("linear"); }),
            "registration.json: 'alignment.linear' is missing");
}

TEST_F(Record, FilesThatAreNoRecordsAreNamed) {
  const auto error = [](const std::string& text) {
    write("bad.json", text);
    return error_of([] { read_registration("bad.json"); });
  };
  const std::string whole = registration_json(example(2), {});
  for (const std::size_t size : {whole.size() / 2, whole.size() - 2})
    EXPECT_THAT(error(whole.substr(0, size)),
                AllOf(HasSubstr("bad.json:"), HasSubstr(": column "), HasSubstr("not valid JSON: ")));
  EXPECT_THAT(error(""), HasSubstr("bad.json"));
  EXPECT_THAT(error("{"), HasSubstr("bad.json:1: column 2: not valid JSON"));
  EXPECT_THAT(error("x,y\n0,1\n"), HasSubstr("bad.json:1: column 1: not valid JSON: "));
  EXPECT_THAT(error("{\"time\": 1e999}"), AllOf(HasSubstr("bad.json: not valid JSON: "), HasSubstr("1e999")));
  EXPECT_EQ(error("[1, 2]"), "bad.json: 'kernel' is missing");
  EXPECT_EQ(error("{}"), "bad.json: 'kernel' is missing");
  EXPECT_EQ(error_of([] { read_registration("none.json"); }), "cannot read 'none.json': No such file or directory");
  EXPECT_THAT(error_of([] { read_registration("."); }), HasSubstr("cannot read '.': it is a folder"));
}

// The last `count` fields of a line, as numbers.
std::vector<double> numbers_of(const std::string& line, std::size_t count) {
  std::vector<double> values;
  std::size_t end = line.size();
  while (values.size() < count) {
    const std::size_t comma = line.rfind(',', end - 1);
    values.insert(values.begin(), std::stod(line.substr(comma + 1, end - comma - 1)));
    end = comma;
  }
  return values;
}

TEST_F(Record, ResidualsTableHasARowForEachLandmark) {
  const std::vector<std::string> headers = {
      "landmark,label,target_x,result_x,residual_x,distance",
      "landmark,label,target_x,target_y,result_x,result_y,residual_x,residual_y,distance",
      "landmark,label,target_x,target_y,target_z,result_x,result_y,result_z,residual_x,residual_y,residual_z,distance"};
  for (int d = 1; d <= 3; ++d) {
    matching::Registration fit = example(d);
    const std::vector<std::string> lines = lines_of(residuals_csv(fit, {}));
    ASSERT_EQ(lines.size(), 5U);
    EXPECT_EQ(lines[0], headers[static_cast<std::size_t>(d) - 1]);
    EXPECT_EQ(lines[1].substr(0, 8), "1,\"tip\",");
    EXPECT_EQ(lines[2].substr(0, 22), "2,\"left \"\"inner\"\", 2\",");
    for (int a = 0; a < 4; ++a) {
      std::vector<double> expected;
      for (int c = 0; c < d; ++c) expected.push_back(fit.target.points(c, a));
      for (int c = 0; c < d; ++c) expected.push_back(fit.result(c, a));
      for (int c = 0; c < d; ++c) expected.push_back(fit.result(c, a) - fit.target.points(c, a));
      expected.push_back(fit.distances()[a]);
      EXPECT_EQ(numbers_of(lines[static_cast<std::size_t>(a) + 1], expected.size()), expected);
    }
    fit.source.labels.clear();
    EXPECT_EQ(lines_of(residuals_csv(fit, {}))[1].substr(0, 3), "1,,");
  }
}

TEST_F(Record, TrajectoryTableHasARowForEachStepAndLandmark) {
  const std::vector<std::string> headers = {"step,time,landmark,q_x,p_x", "step,time,landmark,q_x,q_y,p_x,p_y",
                                            "step,time,landmark,q_x,q_y,q_z,p_x,p_y,p_z"};
  for (int d = 1; d <= 3; ++d) {
    const matching::Registration fit = example(d);
    const Trajectory path = replay(fit);
    const std::vector<std::string> lines = lines_of(trajectory_csv(fit, path));
    ASSERT_EQ(lines.size(), 1U + 7 * 4);
    EXPECT_EQ(lines[0], headers[static_cast<std::size_t>(d) - 1]);
    for (std::size_t k = 0; k <= 6; ++k) {
      for (int a = 0; a < 4; ++a) {
        std::vector<double> expected = {static_cast<double>(k), path.grid.at(static_cast<int>(k)), a + 1.0};
        for (int c = 0; c < d; ++c) expected.push_back(path.states[k].q(c, a));
        for (int c = 0; c < d; ++c) expected.push_back(path.states[k].p(c, a));
        EXPECT_EQ(numbers_of("," + lines[1 + 4 * k + static_cast<std::size_t>(a)], expected.size()), expected);
      }
    }
    EXPECT_EQ(path.initial().q, fit.source.points);
    EXPECT_EQ(path.grid.at(6), 0.7);
  }
}

}  // namespace
}  // namespace pulson::records
