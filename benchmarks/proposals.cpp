// How often the ellipse in which `pulson view` proposes a landmark holds it: a table in Markdown, see
// docs/view_checked.md.
//
//   proposals [--pairs 1000] [--seed 1] NAME=FILE …
//
// For each pair: two specimens of a cohort are drawn, and a number of landmarks from 4 to 16, as many as there are. Of
// these all but the last are known on both, and the last is proposed on the second. The function is that of the page.

#include <algorithm>
#include <cmath>
#include <exception>
#include <numeric>
#include <optional>
#include <random>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <Eigen/LU>
#include <fmt/format.h>

#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "view/judgement.hpp"

namespace {

using namespace pulson;

constexpr int kFewest = 4, kMost = 16;  // landmarks, that which is proposed among them

struct Counted {
  int proposed = 0;
  int held = 0;
  std::vector<double> radii{};      // of the circle of the ellipse's area, over the diameter of the known landmarks
  std::vector<double> distances{};  // of the landmark from the ellipse's centre, the same
};

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + std::ssize(values) / 2;
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

class Draws {
 public:
  Draws(const std::vector<Landmarks>& shapes, std::uint64_t seed) : shapes_(shapes), engine_(seed) {}

  void propose(Counted& counted) {
    const int count = shapes_.front().count();
    std::vector<int> order(static_cast<std::size_t>(count));
    std::iota(order.begin(), order.end(), 0);
    std::shuffle(order.begin(), order.end(), engine_);
    order.resize(static_cast<std::size_t>(kFewest + below(std::min(count, kMost) - kFewest + 1)));
    const int first = below(static_cast<int>(shapes_.size()));
    int second = first;
    while (second == first) second = below(static_cast<int>(shapes_.size()));
    const Points left = shapes_[static_cast<std::size_t>(first)].points(Eigen::all, order);
    Points right = shapes_[static_cast<std::size_t>(second)].points(Eigen::all, order);
    const Eigen::Vector2d truth = right.rightCols<1>();
    if (!left.allFinite() || !right.allFinite()) return;
    right.rightCols<1>().setConstant(std::nan(""));
    const int wanted = static_cast<int>(order.size()) - 1;
    const std::optional<view::Ellipse> ellipse = view::judge_placement(left, right, wanted).proposal;
    if (!ellipse) return;
    ++counted.proposed;
    counted.held += ellipse->contains(truth) ? 1 : 0;
    const double size = diameter(right.leftCols(wanted));
    counted.radii.push_back(std::pow(ellipse->shape.determinant(), 0.25) / size);
    counted.distances.push_back((truth - ellipse->centre).norm() / size);
  }

 private:
  int below(int count) { return std::uniform_int_distribution<int>(0, count - 1)(engine_); }

  const std::vector<Landmarks>& shapes_;
  std::mt19937_64 engine_;
};

void require_cohort(const std::string& file, const std::vector<Landmarks>& shapes) {
  if (shapes.size() < 2) throw InputError(fmt::format("{}: two shapes are needed", file));
  for (const Landmarks& shape : shapes)
    if (shape.dimension() != 2 || shape.count() != shapes.front().count() || shape.count() < kFewest)
      throw InputError(fmt::format("{}: shapes of the plane with the same landmarks, {} or more, are needed",
                                   shape.source, kFewest));
}

void run(const std::vector<std::string>& cohorts, int pairs, std::uint64_t seed) {
  fmt::print("| cohort | shapes × landmarks | proposals | hold the landmark | median radius | median distance |\n");
  fmt::print("|---|---|---|---|---|---|\n");
  for (const std::string& named : cohorts) {
    const std::size_t sign = named.find('=');
    if (sign == std::string::npos) throw InputError(fmt::format("'{}' is no NAME=FILE", named));
    const std::string file = named.substr(sign + 1);
    const std::vector<Landmarks> shapes = formats::read_landmark_file(file).shapes;
    require_cohort(file, shapes);
    Counted counted;
    Draws draws(shapes, seed);
    for (int i = 0; i < pairs; ++i) draws.propose(counted);
    fmt::print("| {} | {} × {} | {} | {:.1f} % | {:.1f} % | {:.1f} % |\n", named.substr(0, sign), shapes.size(),
               shapes.front().count(), counted.proposed, 100.0 * counted.held / std::max(counted.proposed, 1),
               100 * median(counted.radii), 100 * median(counted.distances));
  }
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App program("How often proposed ellipses of pulson view hold the landmark");
  std::vector<std::string> cohorts;
  int pairs = 1000;
  std::uint64_t seed = 1;
  program.add_option("COHORTS", cohorts, "NAME=FILE")->required();
  program.add_option("--pairs", pairs, "of each cohort")->check(CLI::PositiveNumber);
  program.add_option("--seed", seed, "of the pairs");
  CLI11_PARSE(program, argc, argv);
  try {
    run(cohorts, pairs, seed);
  } catch (const std::exception& error) {
    fmt::print(stderr, "proposals: {}\n", error.what());
    return 2;
  }
  return 0;
}
