// How well `pulson atlas` predicts landmarks that a specimen misses, beside what is usual, and how much its bands
// cover: a table in Markdown, see docs/atlas.md.
//
//   predict_missing [--fractions 1,5,10,20] [--draws 5] [--seed 1] NAME=FILE …
//
// Each specimen in turn is left out of the cohort; some of its landmarks, as many as the fraction says and at least
// one, are hidden, anew in each draw; the model of the others predicts them. Beside it stand the thin-plate spline from
// their mean through the landmarks that are left, the regression of the hidden coordinates on the others (two-block
// partial least squares, as `estimate.missing` of geomorph), and the mean itself. Errors are root mean squares of
// distances over the root mean square radius of the shape.
//
//   predict_missing --in-all 1,2,3 [--regions] [--draws 5] [--seed 1] NAME=FILE …
//
// The same where no specimen is complete: so many landmarks are hidden in each, and the atlas of all predicts them. The
// mean is that of the landmarks observed, placed on the specimen by these; a regression needs complete specimens.
// --regions: the hidden landmarks are a random one and those nearest to it.

#include <algorithm>
#include <cmath>
#include <exception>
#include <numeric>
#include <random>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "core/factorisations.hpp"
#include "pulson/cohort/prediction.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/warp/material_flow.hpp"

namespace {

using namespace pulson;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

std::vector<Landmarks> read_cohort(const std::string& file) {
  std::vector<Landmarks> shapes;
  for (Landmarks& shape : formats::read_addressed_shapes(file).shapes)
    if (shape.points.allFinite() && (shapes.empty() || shapes.front().points.cols() == shape.points.cols()))
      shapes.push_back(std::move(shape));
  if (shapes.size() < 3) throw InputError(file + ": fewer than three complete shapes");
  return shapes;
}

struct Hidden {
  std::vector<Index> hidden, seen;  // landmarks

  std::vector<Index> coordinates(const std::vector<Index>& landmarks, Index d) const {
    std::vector<Index> all;
    for (const Index a : landmarks)
      for (Index axis = 0; axis < d; ++axis) all.push_back(a * d + axis);
    return all;
  }
};

Hidden hide(Index count, double fraction, std::mt19937_64& engine) {
  std::vector<Index> order(static_cast<std::size_t>(count));
  for (Index a = 0; a < count; ++a) order[static_cast<std::size_t>(a)] = a;
  std::shuffle(order.begin(), order.end(), engine);
  const auto hidden = std::max<std::ptrdiff_t>(1, std::lround(fraction * static_cast<double>(count)));
  Hidden found{{order.begin(), order.begin() + hidden}, {order.begin() + hidden, order.end()}};
  std::sort(found.hidden.begin(), found.hidden.end());
  std::sort(found.seen.begin(), found.seen.end());
  return found;
}

// A random landmark and those nearest to it.
Hidden hide_region(const Points& mean, Index hidden, std::mt19937_64& engine) {
  const Index centre = std::uniform_int_distribution<Index>(0, mean.cols() - 1)(engine);
  std::vector<Index> order(static_cast<std::size_t>(mean.cols()));
  std::iota(order.begin(), order.end(), 0);
  const auto distance = [&](Index a) { return (mean.col(a) - mean.col(centre)).norm(); };
  std::sort(order.begin(), order.end(), [&](Index a, Index b) { return distance(a) < distance(b); });
  Hidden found{{order.begin(), order.begin() + hidden}, {order.begin() + hidden, order.end()}};
  std::sort(found.hidden.begin(), found.hidden.end());
  std::sort(found.seen.begin(), found.seen.end());
  return found;
}

Points by_spline(const Points& mean, const Points& shape, const Hidden& hidden) {
  const Points labels = mean(Eigen::all, hidden.seen);
  const auto space = warp::LabelSpace::make(warp::LabelKernel::kThinPlate, make_kernel("gaussian:alpha=1"), labels);
  const Points places = mean(Eigen::all, hidden.hidden);
  return places + space->coefficients(shape(Eigen::all, hidden.seen) - labels) * space->basis(places);
}

// The others aligned with their mean, the shape by its remaining landmarks.
Points by_regression(const Points& mean, const std::vector<Points>& others, const Points& shape, const Hidden& hidden) {
  const Index d = mean.rows(), n = static_cast<Index>(others.size());
  const std::vector<Index> from = hidden.coordinates(hidden.seen, d), to = hidden.coordinates(hidden.hidden, d);
  MatrixXd x(n, std::ssize(from)), y(n, std::ssize(to));
  for (Index i = 0; i < n; ++i) {
    const VectorXd change = (others[static_cast<std::size_t>(i)] - mean).reshaped();
    x.row(i) = change(from).transpose();
    y.row(i) = change(to).transpose();
  }
  const Eigen::BDCSVD<MatrixXd> factors(x.transpose() * y, Eigen::ComputeThinU | Eigen::ComputeThinV);
  const MatrixXd u = factors.matrixU().leftCols(std::min(n - 1, factors.matrixU().cols()));
  const MatrixXd slope = (x * u).completeOrthogonalDecomposition().solve(y);
  const VectorXd seen = (shape - mean).reshaped()(from);
  const VectorXd moved = (seen.transpose() * u * slope).transpose();
  return mean(Eigen::all, hidden.hidden) + moved.reshaped(d, std::ssize(hidden.hidden));
}

struct Sums {
  double model = 0, spline = 0, regression = 0, mean = 0, landmarks = 0, covered = 0, coordinates = 0;
};

double mean_square_radius(const Points& points) {
  return (points.colwise() - points.rowwise().mean()).squaredNorm() / static_cast<double>(points.cols());
}

void add(Sums& sums, const Landmarks& truth, const cohort::ShapePredictor& predictor, const std::vector<Points>& others,
         AlignmentKind alignment, const Hidden& hidden) {
  Landmarks shape = truth;
  for (const Index a : hidden.hidden) shape.points.col(a).setConstant(std::nan(""));
  const Points& mean = predictor.mean();
  const Alignment map = align(shape.points, mean, alignment);
  const Points aligned = map.apply(truth.points), target = aligned(Eigen::all, hidden.hidden);
  const double size = mean_square_radius(aligned);
  const cohort::PredictedLandmarks predicted = predictor.predict(shape);
  sums.model += (map.apply(predicted.positions) - target).squaredNorm() / size;
  sums.spline += (by_spline(mean, aligned, hidden) - target).squaredNorm() / size;
  sums.regression += (by_regression(mean, others, aligned, hidden) - target).squaredNorm() / size;
  sums.mean += (mean(Eigen::all, hidden.hidden) - target).squaredNorm() / size;
  sums.landmarks += static_cast<double>(target.cols());
  const Eigen::ArrayXXd error = (predicted.positions - truth.points(Eigen::all, hidden.hidden)).array().abs();
  sums.covered += (error <= predicted.half_widths.array()).cast<double>().sum();
  sums.coordinates += static_cast<double>(target.size());
}

void study(const std::string& name, const std::vector<Landmarks>& shapes, const std::vector<double>& fractions,
           int draws, std::uint64_t seed) {
  std::vector<Sums> sums(fractions.size());
  std::mt19937_64 engine(seed);
  for (std::size_t left_out = 0; left_out < shapes.size(); ++left_out) {
    std::vector<Landmarks> rest = shapes;
    rest.erase(rest.begin() + static_cast<std::ptrdiff_t>(left_out));
    const cohort::Atlas atlas = cohort::make_atlas(rest);
    const cohort::ShapePredictor predictor(atlas);
    std::vector<Points> others;
    for (const cohort::AtlasSpecimen& specimen : atlas.specimens) others.push_back(specimen.shape.points);
    for (std::size_t f = 0; f < fractions.size(); ++f)
      for (int draw = 0; draw < draws; ++draw)
        add(sums[f], shapes[left_out], predictor, others, atlas.alignment,
            hide(shapes[left_out].points.cols(), fractions[f] / 100, engine));
  }
  for (std::size_t f = 0; f < fractions.size(); ++f) {
    const auto rms = [&](double squares) { return 100 * std::sqrt(squares / sums[f].landmarks); };
    fmt::print("| {} | {:g} % | **{:.2f}** | {:.2f} | {:.2f} | {:.2f} | {:.1f} % |\n", name, fractions[f],
               rms(sums[f].model), rms(sums[f].spline), rms(sums[f].regression), rms(sums[f].mean),
               100 * sums[f].covered / sums[f].coordinates);
    std::fflush(stdout);
  }
}

void add_draw(Sums& sums, const std::vector<Landmarks>& truth, const std::vector<Hidden>& hidden) {
  std::vector<Landmarks> shapes = truth;
  for (std::size_t i = 0; i < shapes.size(); ++i)
    for (const Index a : hidden[i].hidden) shapes[i].points.col(a).setConstant(std::nan(""));
  const cohort::Atlas atlas = cohort::make_atlas(shapes);
  const std::vector<cohort::PredictedLandmarks> predicted = predict_missing(atlas, shapes);
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    const std::vector<Index>& places = hidden[i].hidden;
    const Points target = truth[i].points(Eigen::all, places);
    const Points mean = align(atlas.mean.points, shapes[i].points, atlas.alignment).apply(atlas.mean.points);
    const double size = mean_square_radius(truth[i].points);
    const Eigen::ArrayXXd error = (predicted[i].positions - target).array();
    sums.model += error.square().sum() / size;
    sums.spline += (by_spline(mean, shapes[i].points, hidden[i]) - target).squaredNorm() / size;
    sums.mean += (mean(Eigen::all, places) - target).squaredNorm() / size;
    sums.landmarks += static_cast<double>(target.cols());
    sums.covered += (error.abs() <= predicted[i].half_widths.array()).cast<double>().sum();
    sums.coordinates += static_cast<double>(target.size());
  }
}

void study_incomplete(const std::string& name, const std::vector<Landmarks>& shapes, const std::vector<Index>& counts,
                      bool in_regions, int draws, std::uint64_t seed) {
  const Points mean = procrustes_mean(shapes, AlignmentKind::kSimilarity).points;
  for (const Index count : counts) {
    Sums sums;
    double worst = 0;
    std::mt19937_64 engine(seed);
    for (int draw = 0; draw < draws; ++draw) {
      std::vector<Hidden> hidden;
      for (std::size_t i = 0; i < shapes.size(); ++i)
        hidden.push_back(
            in_regions ? hide_region(mean, count, engine)
                       : hide(mean.cols(), static_cast<double>(count) / static_cast<double>(mean.cols()), engine));
      Sums one;
      add_draw(one, shapes, hidden);
      worst = std::max(worst, std::sqrt(one.model / one.mean));
      sums.model += one.model, sums.spline += one.spline, sums.mean += one.mean;
      sums.landmarks += one.landmarks, sums.covered += one.covered, sums.coordinates += one.coordinates;
    }
    const auto rms = [&](double squares) { return 100 * std::sqrt(squares / sums.landmarks); };
    fmt::print("| {} | {} | **{:.2f}** | {:.2f} | {:.2f} | {:.2f} | {:.1f} % |\n", name, count, rms(sums.model),
               rms(sums.spline), rms(sums.mean), worst, 100 * sums.covered / sums.coordinates);
    std::fflush(stdout);
  }
}

int run(int argc, char** argv) {
  CLI::App program("Predictions of missing landmarks by the model of a cohort");
  std::vector<std::string> cohorts;
  std::vector<double> fractions{1, 5, 10, 20};
  int draws = 5;
  std::vector<Index> in_all;
  bool in_regions = false;
  std::uint64_t seed = 1;
  program.add_option("COHORT", cohorts, "NAME=FILE")->required();
  program.add_option("--fractions", fractions, "per cent of the landmarks")->delimiter(',');
  program.add_option("--in-all", in_all, "landmarks hidden in each specimen of the cohort")->delimiter(',');
  program.add_flag("--regions", in_regions, "which are neighbours");
  program.add_option("--draws", draws, "for each specimen and fraction");
  program.add_option("--seed", seed);
  CLI11_PARSE(program, argc, argv);
  fmt::print(
      "| cohort | hidden | model | thin-plate spline | {} | covered by bands of 90 % |\n"
      "|---|---|---|---|---|---|---|\n",
      in_all.empty() ? "regression | mean" : "mean | largest ratio to it of a draw");
  for (const std::string& cohort : cohorts) {
    const std::size_t equals = cohort.find('=');
    const std::vector<Landmarks> shapes = read_cohort(equals == std::string::npos ? cohort : cohort.substr(equals + 1));
    const std::string name =
        fmt::format("{}, {} × {}", cohort.substr(0, equals), shapes.size(), shapes.front().count());
    if (in_all.empty())
      study(name, shapes, fractions, draws, seed);
    else
      study_incomplete(name, shapes, in_all, in_regions, draws, seed);
  }
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    fmt::print(stderr, "predict_missing: {}\n", error.what());
    return 1;
  }
}
