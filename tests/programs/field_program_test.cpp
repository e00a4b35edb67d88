// `--field` of the verbs `simulate` and `register`: the velocity field of a path as files.

#include <cmath>
#include <cstring>
#include <map>

#include <gmock/gmock.h>

#include "draw/animation.hpp"
#include "program.hpp"

namespace pulson {
namespace {

using testing::HasSubstr;
using testing::StartsWith;

class FieldProgram : public Program {
 protected:
  static std::vector<std::vector<double>> rows_of(const std::string& csv) {
    std::vector<std::vector<double>> rows;
    std::istringstream lines(contents(csv));
    std::string line;
    for (std::getline(lines, line); std::getline(lines, line);) {
      std::istringstream cells(line);
      auto& row = rows.emplace_back();
      for (std::string cell; std::getline(cells, cell, ',');) row.push_back(std::stod(cell));
    }
    return rows;
  }

  // The last `count` numbers of an array.
  static std::vector<double> numbers_of(const std::string& npy, std::size_t count) {
    const std::string bytes = contents(npy);
    std::vector<double> numbers(count);
    if (bytes.size() >= 8 * count) std::memcpy(numbers.data(), bytes.data() + bytes.size() - 8 * count, 8 * count);
    return numbers;
  }
};

// The table against the sum over the landmarks of paths.csv, and the array against the table.
TEST_F(FieldProgram, IsTheSumOverTheLandmarksOfThePath) {
  const ProgramRun done =
      run(words("simulate --q 0/0,1/0.5 --p 1/0,-0.5/1 --kernel peakon:alpha=0.8 --noise ch-sd:beta=0.2 --time 1 --dt "
                "0.25 --samples 2 --every 3 --field u.csv --field u.npy --field u.png --grid-points 9 -o out"));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("field      3 times of 8 x 9 points: u.csv, u.npy, u.png"));
  EXPECT_THAT(contents("u.csv"), StartsWith("time,x,y,u_x,u_y\n"));
  EXPECT_THAT(contents("u.png"), StartsWith("\x89PNG"));
  std::map<double, std::vector<std::vector<double>>> states;  // of path 1, by time
  for (const std::vector<double>& row : rows_of("out/paths.csv"))
    if (row[0] == 1) states[row[2]].push_back(row);
  const std::vector<std::vector<double>> rows = rows_of("u.csv");
  for (const std::vector<double>& row : rows) {
    double u[2] = {0, 0};
    for (const std::vector<double>& b : states.at(row[0]))
      for (std::size_t i = 0; i < 2; ++i) u[i] += b[6 + i] * std::exp(-std::hypot(row[1] - b[4], row[2] - b[5]) / 0.8);
    for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(row[3 + i], u[i], 1e-12);
  }
  EXPECT_EQ(states.size(), 3U);
  const std::size_t points = rows.size() / 3;
  const std::vector<double> numbers = numbers_of("u.npy", 2 * rows.size());
  for (std::size_t r = 0; r < rows.size(); ++r)
    for (std::size_t i = 0; i < 2; ++i)
      EXPECT_EQ(numbers[(2 * (r / points) + i) * points + r % points], rows[r][3 + i]);
  const nlohmann::json field = read_json("out/simulation.json")["field"];
  EXPECT_EQ(field["sizes"][0], 3);
  EXPECT_EQ(field["x"].size() * field["y"].size(), points);
  EXPECT_EQ(field["x"][0], rows[0][1]);
  EXPECT_EQ(field["times"], (std::vector<double>{0, 0.75, 1}));
}

TEST_F(FieldProgram, OfARegistrationIsThatOfItsStates) {
  const ProgramRun done = run(joined({"register", "--field", "u.csv", sample("swap_source"), sample("swap_target")},
                                     words("--noise ch-sd:beta=100% --kernel gaussian:alpha=1 --field u.svg "
                                           "--grid-points 5 -o out --no-picture")));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(contents("u.svg"), HasSubstr("Velocity u over time t"));
  std::map<double, std::vector<std::vector<double>>> states;
  for (const std::vector<double>& row : rows_of("out/trajectory.csv")) states[row[1]].push_back(row);
  const std::vector<std::vector<double>> rows = rows_of("u.csv");
  EXPECT_EQ(rows.size(), 5 * states.size());
  for (const std::vector<double>& row : rows) {
    double u = 0;
    for (const std::vector<double>& b : states.at(row[0])) u += b[4] * std::exp(-(row[1] - b[3]) * (row[1] - b[3]));
    EXPECT_NEAR(row[2], u, 1e-12);
  }
  EXPECT_EQ(run(words("simulate --from out/registration.json --dt 0.5 --no-picture -o again")).exit_code, 0);
}

TEST_F(FieldProgram, AnimatesALine) {
  if (!draw::Animation::available()) GTEST_SKIP() << "there is no ffmpeg";
  const ProgramRun done = run(
      words("simulate --q 0,2 --p 2,1 --kernel peakon:alpha=1 --time 1 --dt 0.25 --field u.gif --no-picture -o out"));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(contents("u.gif"), StartsWith("GIF8"));
}

TEST_F(FieldProgram, RefusesWhatItCannotWrite) {
  const auto refusal = [](const std::string& options) {
    const ProgramRun done = run(words(options));
    EXPECT_EQ(done.exit_code, 2);
    EXPECT_FALSE(std::filesystem::exists("out/simulation.json"));
    return done.err;
  };
  const std::string space =
      "simulate --q 0/0/0,1/1/1 --p 1/0/0,0/0/1 --kernel gaussian:alpha=1 --time 1 -o out --field ";
  EXPECT_THAT(refusal(space + "u.png"), HasSubstr("u.png: pictures of a field are of a line or the plane"));
  EXPECT_THAT(refusal(space + "u.txt"), HasSubstr("u.txt: --field writes .npy and .csv, pictures"));
  EXPECT_THAT(refusal(space + "u.npy --grid-points 2000"), HasSubstr("--field may have"));
  EXPECT_THAT(refusal(space + "u.npy --grid-points 1"), HasSubstr("--grid-points is 1"));
  EXPECT_THAT(refusal("register " + sample("swap_source") + " " + sample("swap_target") + " " + sample("swap_target") +
                      " -o out --field u.npy"),
              HasSubstr("--field is for one target"));
  EXPECT_EQ(run(words(space + "u.npy --grid-points 4 --dt 0.5 --no-picture")).exit_code, 0);
  EXPECT_THAT(contents("u.npy").substr(0, 128), HasSubstr("'shape': (3, 3, 3, 3, 4,)"));
}

}  // namespace
}  // namespace pulson
