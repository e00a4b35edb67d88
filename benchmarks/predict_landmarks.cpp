// How well the map of a registration with all defaults predicts a landmark that it did not see, beside what needs no
// deformation model: a table in Markdown, see docs/matching.md, "Kernel".
//
//   predict_landmarks [--draws 200] [--seed 1] [--families] NAME=FILE[,FILE…] …
//
// For each draw: two shapes of the cohort and one landmark, left out of both; the shapes are registered, and the
// landmark of the first is moved. Its distance to that of the second, over the root mean square radius of the second.
//
// --families: the same by the linear model of fit_displacements() for each family of kernels; every landmark of a draw
// is left out in turn.

#include <cmath>
#include <exception>
#include <map>
#include <random>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <Eigen/QR>
#include <fmt/format.h>

#include "pulson/core/parallel.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/matching/registration.hpp"
#include "pulson/warp/material_flow.hpp"

namespace {

using namespace pulson;
using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

struct Cohort {
  std::string name;
  std::vector<Landmarks> shapes;
};

Cohort read_cohort(const std::string& argument) {
  const std::size_t equals = argument.find('=');
  Cohort cohort{argument.substr(0, equals), {}};
  std::string files = equals == std::string::npos ? argument : argument.substr(equals + 1);
  for (const std::string& file : CLI::detail::split(files, ','))
    for (Landmarks& shape : formats::read_addressed_shapes(file).shapes)
      if (shape.points.allFinite() &&
          (cohort.shapes.empty() || cohort.shapes.front().points.cols() == shape.points.cols()))
        cohort.shapes.push_back(std::move(shape));
  if (cohort.shapes.size() < 2) throw InputError(argument + ": fewer than two complete shapes");
  return cohort;
}

MatrixXd spline_values(const Points& x, const Points& y) {
  MatrixXd values(x.cols(), y.cols());
  for (Index j = 0; j < y.cols(); ++j)
    for (Index i = 0; i < x.cols(); ++i) {
      const double r = (x.col(i) - y.col(j)).norm();
      values(i, j) = x.rows() == 2 ? (r > 0 ? r * r * std::log(r) : 0) : r;
    }
  return values;
}

// The interpolating thin-plate spline (r² log r in the plane, r in space; F. Bookstein 1989).
Points thin_plate(const Points& source, const Points& target, const Points& at) {
  const Index n = source.cols(), d = source.rows();
  MatrixXd system = MatrixXd::Zero(n + d + 1, n + d + 1);
  system.topLeftCorner(n, n) = spline_values(source, source);
  system.block(0, n, n, 1).setOnes();
  system.topRightCorner(n, d) = source.transpose();
  system.bottomLeftCorner(d + 1, n) = system.topRightCorner(n, d + 1).transpose();
  MatrixXd right = MatrixXd::Zero(n + d + 1, d);
  right.topRows(n) = target.transpose();
  MatrixXd terms(at.cols(), n + d + 1);
  terms << spline_values(at, source), VectorXd::Ones(at.cols()), at.transpose();
  return (terms * system.fullPivHouseholderQr().solve(right)).transpose();
}

struct Errors {
  std::map<std::string, double> of;
  bool matched = false, converged = false;
};

Errors left_out(const Landmarks& first, const Landmarks& second, Index landmark) {
  std::vector<Index> others;
  for (Index a = 0; a < first.points.cols(); ++a)
    if (a != landmark) others.push_back(a);
  Landmarks source, target;
  source.points = first.points(Eigen::all, others);
  target.points = second.points(Eigen::all, others);
  const Points seen = first.points.col(landmark), wanted = second.points.col(landmark);
  const double radius =
      std::sqrt((second.points.colwise() - second.points.rowwise().mean()).colwise().squaredNorm().mean());
  const auto error = [&](const Points& predicted) { return (predicted - wanted).norm() / radius; };

  Errors errors;
  for (const auto& [name, kind] :
       {std::pair{"similarity", AlignmentKind::kSimilarity}, {"affine", AlignmentKind::kAffine}})
    errors.of[name] = error(align(source.points, target.points, kind).apply(seen));
  errors.of["thin-plate spline"] = error(thin_plate(source.points, target.points, seen));
  const matching::Registration registration = matching::register_shapes(source, target);
  const warp::MaterialFlow flow(registration_system(registration), replay(registration));
  errors.of["pulson"] = error(flow.end(registration.alignment.apply(seen)));
  errors.matched = registration.matched();
  errors.converged = registration.converged;
  return errors;
}

struct Draw {
  std::size_t first, second, landmark;
};

std::vector<Draw> draw(const Cohort& cohort, int draws, unsigned seed) {
  std::mt19937 generator(seed);
  std::vector<Draw> chosen;
  for (int i = 0; i < draws; ++i) {
    const std::size_t first = generator() % cohort.shapes.size();
    const std::size_t second = (first + 1 + generator() % (cohort.shapes.size() - 1)) % cohort.shapes.size();
    chosen.push_back({first, second, generator() % static_cast<std::size_t>(cohort.shapes.front().count())});
  }
  return chosen;
}

void print_row(const Cohort& cohort, int draws, unsigned seed) {
  const std::vector<Draw> chosen = draw(cohort, draws, seed);
  std::vector<Errors> errors(chosen.size());
  parallel_for(draws, [&](int i) {
    const auto [first, second, landmark] = chosen[static_cast<std::size_t>(i)];
    try {
      errors[static_cast<std::size_t>(i)] =
          left_out(cohort.shapes[first], cohort.shapes[second], static_cast<Index>(landmark));
    } catch (const Error&) {  // landmarks at one place in the source alone, or a map that the steps do not resolve
    }
  });
  const int asked = draws;
  std::erase_if(errors, [](const Errors& each) { return each.of.empty(); });
  draws = static_cast<int>(errors.size());
  std::map<std::string, double> mean, square;
  int matched = 0, converged = 0;
  for (const Errors& each : errors) {
    for (const auto& [name, error] : each.of) mean[name] += error / draws, square[name] += error * error / draws;
    matched += each.matched ? 1 : 0;
    converged += each.converged ? 1 : 0;
  }
  fmt::print("| {} | {} × {}, {}D ", cohort.name, cohort.shapes.size(), cohort.shapes.front().count(),
             cohort.shapes.front().dimension());
  for (const char* name : {"similarity", "affine", "thin-plate spline", "pulson"})
    fmt::print("| {:.4f} ± {:.4f} ", mean[name], std::sqrt((square[name] - mean[name] * mean[name]) / draws));
  const std::string rival = mean["similarity"] < mean["thin-plate spline"] ? "similarity" : "thin-plate spline";
  const double ratio = mean["pulson"] / mean[rival];
  double variance = 0;  // of the ratio, by its linearisation
  for (const Errors& each : errors)
    variance += std::pow((each.of.at("pulson") - ratio * each.of.at(rival)) / mean[rival] / draws, 2);
  fmt::print("| {:.3f} ± {:.3f} | {} | {} | {} |\n", ratio, std::sqrt(variance), draws - matched, draws - converged,
             asked - draws);
  std::fflush(stdout);
}

// Root mean square error of the landmarks left out in turn, by each family, the alignment and the spline.
std::map<std::string, double> family_errors(const Landmarks& first, const Landmarks& second) {
  const Points source = align(first.points, second.points, AlignmentKind::kSimilarity).apply(first.points);
  matching::DisplacementOptions options;
  options.alignment = AlignmentKind::kSimilarity;
  options.sigma = 0.005 * diameter(source);
  std::map<std::string, double> errors;
  for (const auto& [name, profile] : {std::pair{"gaussian", KernelProfile::kGaussian},
                                      {"matern52", KernelProfile::kMatern52},
                                      {"matern32", KernelProfile::kMatern32},
                                      {"peakon", KernelProfile::kPeakon}}) {
    options.profile = profile;
    const auto model = fit_displacements(source, second.points, options);
    if (!model) return {};
    errors[name] = model->prediction_error;
    errors["similarity"] = model->alignment_error;
  }
  double squares = 0;
  for (Index out = 0; out < source.cols(); ++out) {
    std::vector<Index> others;
    for (Index a = 0; a < source.cols(); ++a)
      if (a != out) others.push_back(a);
    const Points predicted = thin_plate(source(Eigen::all, others), second.points(Eigen::all, others), source.col(out));
    squares += (predicted - second.points.col(out)).squaredNorm();
  }
  errors["thin-plate spline"] = std::sqrt(squares / static_cast<double>(source.cols()));
  return errors;
}

void print_families(const Cohort& cohort, int draws, unsigned seed) {
  const std::vector<Draw> chosen = draw(cohort, draws, seed);
  std::vector<std::map<std::string, double>> errors(chosen.size());
  parallel_for(draws, [&](int i) {
    const Draw& each = chosen[static_cast<std::size_t>(i)];
    errors[static_cast<std::size_t>(i)] = family_errors(cohort.shapes[each.first], cohort.shapes[each.second]);
  });
  std::map<std::string, double> sum;
  for (const auto& of_draw : errors)
    for (const auto& [name, error] : of_draw) sum[name] += error;
  const double rival = std::min(sum["similarity"], sum["thin-plate spline"]);
  fmt::print("| {} ", cohort.name);
  for (const char* name : {"gaussian", "matern52", "matern32", "peakon"}) fmt::print("| {:.3f} ", sum[name] / rival);
  fmt::print("|\n");
  std::fflush(stdout);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App program("Predicts left-out landmarks");
  int draws = 200;
  unsigned seed = 1;
  bool families = false;
  std::vector<std::string> cohorts;
  program.add_option("--draws", draws)->capture_default_str();
  program.add_option("--seed", seed)->capture_default_str();
  program.add_flag("--families", families);
  program.add_option("COHORT", cohorts, "NAME=FILE[,FILE…]")->required();
  CLI11_PARSE(program, argc, argv);
  try {
    if (families)
      fmt::print("| cohort | gaussian | matern52 | matern32 | peakon |\n|---|---|---|---|---|\n");
    else
      fmt::print(
          "| cohort | shapes × landmarks | similarity | affine | thin-plate spline | pulson, all defaults | over "
          "the better | not matched | not converged | refused |\n|---|---|---|---|---|---|---|---|---|---|\n");
    for (const std::string& argument : cohorts) {
      const Cohort cohort = read_cohort(argument);
      if (families)
        print_families(cohort, draws, seed);
      else
        print_row(cohort, draws, seed);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "predict_landmarks: {}\n", error.what());
    return 2;
  }
}
