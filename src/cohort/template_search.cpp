#include "template_search.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

#include "anderson.hpp"
#include "core/factorisations.hpp"
#include "core/undefined.hpp"
#include "geodesics.hpp"
#include "posed_shapes.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kMatched = 1e-12;       // defect of a match, in diameters
constexpr double kRoundOff = 1e-8;       // one that counts as converged where the search cannot do better
constexpr double kBelowMovement = 1e-3;  // defects, beside the last movement of the template
constexpr double kUnmatched = 0.01;      // defect of a specimen that has no weight in the template, in diameters
constexpr int kTemplateWindow = 5;
constexpr double kCoarse = 1e-4;  // step error, in diameters, that is reported

double precision_of(const AtlasSpecimen& specimen, Index a) {
  return specimen.precisions.size() > 0 ? specimen.precisions[a] : 1;
}

std::vector<Index> observed_landmarks(const AtlasSpecimen& specimen) {
  std::vector<Index> observed;
  for (Index a = 0; a < specimen.shape.points.cols(); ++a)
    if (specimen.shape.points.col(a).allFinite() && precision_of(specimen, a) > 0) observed.push_back(a);
  return observed;
}

// λ∫H dt, ½∫|u|² dt with u = λβp, and the data term.
matching::MatchingCost cost_of(const Atlas& atlas, const Trajectory& path, const AtlasSpecimen& specimen) {
  const double nugget = atlas.nugget();
  matching::MatchingCost cost;
  const double total =
      atlas.lambda * (hamiltonian(atlas.kernel, path.initial()) + 0.5 * nugget * path.initial().p.squaredNorm());
  for (int k = 0; nugget > 0 && k < path.grid.steps; ++k) {
    const auto square = [&](int i) { return path.states[static_cast<std::size_t>(i)].p.squaredNorm(); };
    cost.action += 0.5 * atlas.lambda * nugget * path.grid.dt() * 0.5 * (square(k) + square(k + 1));
  }
  cost.energy = total - cost.action;
  const VectorXd distances = specimen.distances();
  if (atlas.sigma > 0)
    for (Index a = 0; a < path.initial().q.cols(); ++a)
      if (const double distance = distances[a]; std::isfinite(distance))
        cost.data += 0.5 * precision_of(specimen, a) * std::pow(distance / atlas.sigma, 2);
  return cost;
}

// The pose a that momenta contain to first order: Zᵀ(A + τ)⁻¹Za = Zᵀp.
VectorXd pose_of(const MatchModel& model, const MatrixXd& directions, const Points& p) {
  MatrixXd response(directions.rows(), directions.cols());
  for (Index k = 0; k < directions.cols(); ++k) {
    Points moved = Points::Zero(p.rows(), p.cols());
    moved(Eigen::all, model.observed()) = directions.col(k).reshaped(p.rows(), p.cols())(Eigen::all, model.observed());
    response.col(k) = model.momenta(moved).reshaped();
  }
  if (directions.cols() == 0) return VectorXd(0);
  return (directions.transpose() * response).ldlt().solve(directions.transpose() * p.reshaped());
}

class TemplateSearch {
 public:
  TemplateSearch(Atlas& atlas, const AtlasOptions& options)
      : atlas_(atlas),
        options_(options),
        size_(diameter(atlas.mean.points)),
        geodesics_(atlas.kernel, options.steps, atlas.lambda, atlas.beta),
        held_(all_directions(atlas.mean.points)),
        poses_(MatrixXd::Zero(held_.cols(), std::ssize(atlas.specimens))),
        found_poses_(atlas.specimens.size()) {
    for (const AtlasSpecimen& specimen : atlas.specimens) {
      observed_.push_back(observed_landmarks(specimen));
      given_.push_back(specimen.shape.points);
    }
  }

  void run() {
    Anderson search(kTemplateWindow);
    Points& q0 = atlas_.template_shape.points;
    double tolerance = kBelowMovement;
    for (atlas_.iterations = 1;; ++atlas_.iterations) {
      const TemplateMetric metric(atlas_.kernel, atlas_.nugget(), atlas_.lambda * atlas_.sigma * atlas_.sigma, q0);
      match_all(metric, size_ * std::max(kMatched, kBelowMovement * tolerance));
      const Points mean = mean_momenta();
      const VectorXd full = metric.displacement(mean).reshaped();
      const VectorXd step = full - held_ * (held_.transpose() * full);  // pose and size of the template are held
      const MatrixXd poses = pose_steps(q0);
      const double root = std::sqrt(static_cast<double>(q0.cols()));
      atlas_.movement = std::max(step.norm(), poses.colwise().norm().maxCoeff()) / root / size_;
      if (options_.on_iteration) options_.on_iteration(atlas_.iterations, atlas_.movement);
      atlas_.converged = atlas_.movement <= options_.tolerance;
      if (atlas_.converged && tolerance <= options_.tolerance) break;
      if (atlas_.iterations >= options_.max_iterations || search.is_lost()) break;
      tolerance = atlas_.converged ? options_.tolerance : atlas_.movement;
      if (atlas_.converged) continue;                                  // once more, with matches as accurate
      VectorXd place(q0.size() + poses.size()), change(place.size());  // root mean squares of like size
      place << q0.reshaped(), poses_.reshaped() / root;
      change << step, poses.reshaped() / root;
      const VectorXd next = search.next(place, -change);
      q0 = next.head(q0.size()).reshaped(q0.rows(), q0.cols());
      poses_ = root * next.tail(poses.size()).reshaped(poses.rows(), poses.cols());
      place_specimens();
      for (AtlasSpecimen& specimen : atlas_.specimens) specimen.momenta -= mean;
    }
    finish();
  }

 private:
  MatrixXd all_directions(const Points& shape) const {
    std::vector<Index> all(static_cast<std::size_t>(shape.size()));
    std::iota(all.begin(), all.end(), 0);
    return motion_directions(shape, atlas_.alignment, all);
  }

  bool is_matched(const AtlasSpecimen& specimen) const {
    return specimen.defect <= std::max(kUnmatched, 0.1 * atlas_.sigma / size_) * size_;
  }

  // The poses that the momenta of each specimen contain, as displacements of the mean; 0 where it is not matched.
  MatrixXd pose_steps(const Points& q0) const {
    const MatrixXd change = held_.transpose() * all_directions(q0);
    MatrixXd steps = MatrixXd::Zero(held_.cols(), poses_.cols());
    for (Index s = 0; s < steps.cols() && held_.cols() > 0; ++s)
      if (is_matched(atlas_.specimens[static_cast<std::size_t>(s)]))
        steps.col(s) = change * found_poses_[static_cast<std::size_t>(s)];
    return steps;
  }

  void place_specimens() {
    const Points& mean = atlas_.mean.points;
    for (std::size_t s = 0; s < given_.size() && held_.cols() > 0; ++s) {
      const VectorXd displacement = held_ * poses_.col(static_cast<Index>(s));
      const Points moved = mean + displacement.reshaped(mean.rows(), mean.cols());
      atlas_.specimens[s].shape.points = align(moved, mean, atlas_.alignment).apply(given_[s]);
    }
  }

  void match_all(const TemplateMetric& metric, double tolerance) {
    std::vector<Index> all(static_cast<std::size_t>(metric.shape().cols()));
    std::iota(all.begin(), all.end(), 0);
    const MatchModel complete(metric, all);
    const MatrixXd directions = all_directions(metric.shape());
    std::vector<double> shots(atlas_.specimens.size());
    share(
        [&](int i) {
          const auto s = static_cast<std::size_t>(i);
          AtlasSpecimen specimen = atlas_.specimens[s];
          std::optional<MatchModel> of_observed;
          if (observed_[s].size() < all.size() || specimen.precisions.size() > 0)
            of_observed.emplace(metric, observed_[s], specimen.precisions);
          const MatchModel& model = of_observed ? *of_observed : complete;
          const int count = match(metric, model, specimen, tolerance);
          VectorXd made(2 * specimen.momenta.size() + directions.cols() + 3);
          made << specimen.momenta.reshaped(), specimen.result.reshaped(), pose_of(model, directions, specimen.momenta),
              specimen.defect, specimen.converged ? 1.0 : 0.0, count;
          return made;
        },
        [&](int i, const VectorXd& made) {
          AtlasSpecimen& specimen = atlas_.specimens[static_cast<std::size_t>(i)];
          const Points& q0 = metric.shape();
          specimen.momenta = made.head(q0.size()).reshaped(q0.rows(), q0.cols());
          specimen.result = made.segment(q0.size(), q0.size()).reshaped(q0.rows(), q0.cols());
          found_poses_[static_cast<std::size_t>(i)] = made.segment(2 * q0.size(), directions.cols());
          specimen.defect = made[made.size() - 3];
          specimen.converged = made[made.size() - 2] != 0;
          shots[static_cast<std::size_t>(i)] = made[made.size() - 1];
        });
    for (const double count : shots) atlas_.shots += static_cast<long>(count);
  }

  void share(const std::function<VectorXd(int)>& make, const std::function<void(int, const VectorXd&)>& store) const {
    const int count = static_cast<int>(atlas_.specimens.size());
    if (options_.share)
      options_.share(count, make, store);
    else
      parallel_for(count, [&](int i) { store(i, make(i)); });
  }

  int match(const TemplateMetric& metric, const MatchModel& model, AtlasSpecimen& specimen, double tolerance) const {
    const auto from = [&](const Points& start) {
      return geodesics_.match(metric, model, specimen.shape.points, start, tolerance);
    };
    GeodesicMatch found;
    try {
      found = from(specimen.momenta);
    } catch (const StepError&) {
      found = from(Points::Zero(specimen.momenta.rows(), specimen.momenta.cols()));
    }
    int shots = found.shots;
    if (!found.converged && found.defect > kRoundOff * size_) {
      if (const std::optional<Points> start = path_search(metric, specimen)) {
        found = from(*start);
        shots += found.shots;
      }
    }
    specimen.momenta = found.momenta;
    specimen.result = found.end.q;
    specimen.defect = found.defect;
    specimen.converged = found.converged || found.defect <= kRoundOff * size_;
    return shots;
  }

  // The momenta that a search over paths finds, for targets that are too far away to be shot at.
  std::optional<Points> path_search(const TemplateMetric& metric, const AtlasSpecimen& specimen) const {
    Landmarks source = atlas_.template_shape;
    source.points = metric.shape();
    matching::RegistrationOptions options;
    options.kernel = atlas_.kernel;
    if (atlas_.beta > 0) options.noise = fmt::format("ch-sd:beta={}", atlas_.beta);
    options.lambda = atlas_.lambda;
    options.sigma = std::max(atlas_.sigma, 1e-4 * size_);
    options.data.weights = specimen.precisions;
    options.align = AlignmentKind::kNone;
    options.grid = geodesics_.grid();
    Landmarks target = specimen.shape;
    target.absent.clear();  // the template keeps what this specimen does not have
    try {
      return register_shapes(source, target, options).momenta;
    } catch (const Error&) {
      return std::nullopt;
    }
  }

  // Of the specimens that are matched: another's momenta mean nothing.
  Points mean_momenta() const {
    Points sum = Points::Zero(atlas_.mean.points.rows(), atlas_.mean.points.cols());
    double count = 0;
    for (const AtlasSpecimen& specimen : atlas_.specimens)
      if (is_matched(specimen)) {
        sum += specimen.momenta;
        count += 1;
      }
    return count > 0 ? Points(sum / count) : sum;
  }

  void finish() {
    const Geodesics finer(atlas_.kernel, 2 * options_.steps, atlas_.lambda, atlas_.beta);
    const Points& q0 = atlas_.template_shape.points;
    std::vector<double> errors(atlas_.specimens.size());
    share(
        [&](int i) {
          AtlasSpecimen specimen = atlas_.specimens[static_cast<std::size_t>(i)];
          const Trajectory path = geodesics_.path(q0, specimen.momenta);
          specimen.result = path.final().q;
          const matching::MatchingCost cost = cost_of(atlas_, path, specimen);
          const double error = (finer.shoot(q0, specimen.momenta).q - specimen.result).norm() /
                               std::sqrt(static_cast<double>(q0.cols())) / size_;
          VectorXd made(q0.size() + 4);
          made << specimen.result.reshaped(), cost.energy, cost.action, cost.data, error;
          return made;
        },
        [&](int i, const VectorXd& made) {
          AtlasSpecimen& specimen = atlas_.specimens[static_cast<std::size_t>(i)];
          specimen.result = made.head(q0.size()).reshaped(q0.rows(), q0.cols());
          specimen.cost = {made[q0.size()], made[q0.size() + 1], made[q0.size() + 2]};
          errors[static_cast<std::size_t>(i)] = made[q0.size() + 3];
        });
    atlas_.step_error = std::accumulate(errors.begin(), errors.end(), 0.0, max_or_undefined);
    if (!(atlas_.step_error <= kCoarse))
      atlas_.notes.push_back(
          fmt::format("twice the steps move an end by {:.2g} diameters: more steps are needed", atlas_.step_error));
  }

  Atlas& atlas_;
  const AtlasOptions& options_;
  double size_;
  Geodesics geodesics_;
  MatrixXd held_;                      // directions at the mean in which the template does not move
  MatrixXd poses_;                     // displacements of the mean in these, a column for each specimen, that place it
  std::vector<VectorXd> found_poses_;  // in the momenta
  std::vector<std::vector<Index>> observed_;
  std::vector<Points> given_;  // where poses_ are 0
};

}  // namespace

void search_template(Atlas& atlas, const AtlasOptions& options) { TemplateSearch(atlas, options).run(); }

}  // namespace pulson::cohort
