#include "pulson/inference/ensemble_kalman.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <limits>

#include <fmt/core.h>

#include "core/factorisations.hpp"
#include "localisation.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "random/normals.hpp"
#include "specimen.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kGroups = 10;  // of members, each updated by the gain of the others
// A path that goes so much farther than the median one has left the range where the time steps resolve it.
constexpr double kFar = 5;
constexpr int kFewestMembers = 2 * kGroups;

void check(const PosteriorProblem& problem, const EnsembleKalmanOptions& options) {
  if (!problem.tree.empty()) throw InputError("an ensemble Kalman smoother takes independent paths, not a tree");
  if (!problem.parameters.empty())
    throw InputError(fmt::format("an ensemble Kalman smoother holds the parameters of the models fixed; {} is to be sampled",
                                 quoted_line(problem.parameters.front().name)));
  if (options.members < kFewestMembers)
    throw InputError(fmt::format("there are {} members; at least {} are needed", options.members, kFewestMembers));
  if (options.rounds < 1) throw InputError(fmt::format("there are {} rounds; at least 1 is needed", options.rounds));
  if (options.localisation && !(*options.localisation > 0))
    throw InputError(
        fmt::format("the radius of the localisation is {}; it must be greater than 0", *options.localisation));
  if (options.paths_kept < 1)
    throw InputError(fmt::format("{} paths are to be kept; at least 1 is needed", options.paths_kept));
}

// Independent streams of random numbers for each specimen.
enum class Stream : std::uint64_t { kMember, kErrors };
std::uint64_t path_number(Stream stream, std::size_t specimen, std::uint64_t number) {
  return (static_cast<std::uint64_t>(stream) << 63U) + (static_cast<std::uint64_t>(specimen) << 32U) + number;
}

// Standard normal numbers of each member, with mean zero over the members and the same variance: m×count.
MatrixXd centred_normals(std::uint64_t seed, Stream stream, std::size_t specimen, std::uint64_t first, Index members,
                         Index count) {
  MatrixXd numbers(members, count);
  parallel_for(static_cast<int>(members), [&](int i) {
    numbers.row(i) = standard_normals(seed, path_number(stream, specimen, first + static_cast<std::uint64_t>(i)), 1,
                                      static_cast<int>(count));
  });
  numbers.rowwise() -= numbers.colwise().mean().eval();
  return numbers * std::sqrt(static_cast<double>(members) / static_cast<double>(members - 1));
}

// The data of each landmark: rows first[a] … first[a + 1] − 1 of the residual.
std::vector<Index> data_of_landmarks(const matching::MatchingProblem& problem) {
  std::vector<Index> first = {0};
  const matching::LandmarkTerm* term = problem.data->landmarks();
  if (term == nullptr) throw InputError("an ensemble Kalman smoother needs landmarks as data");
  for (Index a = 0; a < problem.source.cols(); ++a)
    first.push_back(first.back() + (term->precision(a).diagonal().array() > 0).count());
  return first;
}

// All members of one specimen, whose unknowns z ~ N(0, I) are those of Specimen: a row for each.
class Members {
 public:
  Members(const Specimen& specimen, const Specimen::Model& model, const EnsembleKalmanOptions& options,
          std::size_t number, double radius)
      : specimen_(specimen),
        model_(model),
        options_(options),
        number_(number),
        radius_(radius),
        first_(data_of_landmarks(specimen.problem())),
        sites_(channel_sites(*model.system.noise, specimen.problem().source, radius / 4)),
        z_(centred_normals(options.seed, Stream::kMember, number, 0, options.members, specimen.unknowns())) {}

  Index count() const { return z_.rows(); }

  /// Integrates the path of each member, and leaves out those that have none. @param visit (member, shot)
  template <typename Visit>
  void shoot(const Visit& visit) {
    VectorXd moved = VectorXd::Constant(count(), std::numeric_limits<double>::infinity());
    parallel_for(static_cast<int>(count()), [&](int i) {
      const auto shot = specimen_.shoot(model_, z_.row(i).transpose());
      if (!shot) return;
      moved[i] = (shot->paths.front().final().q - specimen_.problem().source).colwise().norm().maxCoeff();
      visit(i, *shot);
    });
    found_.clear();
    const double far = kFar * quantile(moved, 0.5);
    for (Index i = 0; i < count(); ++i)
      if (moved[i] <= far) found_.push_back(i);
    if (2 * std::ssize(found_) < options_.members || std::ssize(found_) < kFewestMembers)
      throw NumericalError(fmt::format("only {} of {} members have a path: the prior is too wide for these time steps",
                                       found_.size(), options_.members));
    z_ = MatrixXd(z_(found_, Eigen::all));
  }
  const std::vector<Index>& found() const { return found_; }  ///< members of before the last shoot() that are left

  /// One round. @param share_done of progress
  void update(int round, const std::function<void()>& on_path) {
    MatrixXd residuals(count(), specimen_.data());
    shoot([&](int i, const Specimen::Shot& shot) {
      residuals.row(i) = shot.residual.transpose();
      on_path();
    });
    residuals = MatrixXd(residuals(found_, Eigen::all));
    const MatrixXd errors =
        centred_normals(options_.seed, Stream::kErrors, number_,
                        static_cast<std::uint64_t>(round) * static_cast<std::uint64_t>(options_.members), count(),
                        specimen_.data());
    const MatrixXd innovations = std::sqrt(static_cast<double>(options_.rounds)) * errors - residuals;
    residuals.rowwise() -= residuals.colwise().mean().eval();
    assimilate(residuals, innovations);
  }

 private:
  Index landmarks() const { return specimen_.problem().source.cols(); }
  Index dimension() const { return specimen_.problem().source.rows(); }

  // Rows of the residual within the radius of a landmark, with √weight; of no landmark all.
  struct LocalData {
    std::vector<Index> rows;
    VectorXd roots;
  };
  LocalData data_near(Index landmark) const {
    const Points& q0 = specimen_.problem().source;
    LocalData local;
    std::vector<double> roots;
    for (Index b = 0; b < landmarks(); ++b) {
      const double weight = landmark < 0 ? 1 : gaspari_cohn((q0.col(b) - q0.col(landmark)).norm(), radius_);
      if (!(weight > 0)) continue;
      for (Index row = first_[static_cast<std::size_t>(b)]; row < first_[static_cast<std::size_t>(b) + 1]; ++row) {
        local.rows.push_back(row);
        roots.push_back(std::sqrt(weight));
      }
    }
    local.roots = Eigen::Map<const VectorXd>(roots.data(), std::ssize(roots));
    return local;
  }

  // W, m×m: unknowns near there, a column of the ensemble each, change by Wᵀ times that column. Members of one group
  // combine those of the others, and each column of W sums to 0.
  MatrixXd weights(const LocalData& local, const MatrixXd& anomalies, const MatrixXd& innovations) const {
    const Index m = count();
    const MatrixXd y = anomalies(Eigen::all, local.rows) * local.roots.asDiagonal();
    const MatrixXd gram = y * y.transpose();
    const MatrixXd right = y * (innovations(Eigen::all, local.rows) * local.roots.asDiagonal()).transpose();
    MatrixXd weights = MatrixXd::Zero(m, m);
    static const int G = std::getenv("GROUPS_") ? std::atoi(std::getenv("GROUPS_")) : kGroups;
    for (int g = 0; g < G; ++g) {
      std::vector<Index> own, others;
      for (Index i = 0; i < m; ++i) (i % G == g ? own : others).push_back(i);
      if (G == 1) others = own;
      MatrixXd a = centred(gram(others, others));
      a = centred(a.transpose());
      a.diagonal().array() += options_.rounds * static_cast<double>(std::ssize(others) - 1);
      weights(others, own) = MatrixXd(a.llt().solve(centred(right(others, own))));
    }
    return weights;
  }
  static MatrixXd centred(const MatrixXd& rows) { return rows.rowwise() - rows.colwise().mean(); }

  void update_channels(const std::vector<Index>& channels, const MatrixXd& weights) {
    const Index steps = specimen_.problem().grid.steps;
    std::vector<Index> columns;
    for (Index k = 0; k < steps; ++k)
      for (const Index channel : channels)
        columns.push_back(specimen_.momentum_unknowns() + k * specimen_.channels() + channel);
    const MatrixXd own = z_(Eigen::all, columns);
    z_(Eigen::all, columns) = own + weights.transpose() * own;
  }

  void assimilate(const MatrixXd& anomalies, const MatrixXd& innovations) {
    const Index d = dimension(), n = landmarks();
    std::vector<MatrixXd> velocities;  // of each axis, m×N
    for (Index axis = 0; axis < d; ++axis)
      velocities.push_back(by_members(axis, [&](const MatrixXd& z0) -> MatrixXd {
        return z0 * model_.root->transpose().triangularView<Eigen::Upper>();
      }));
    MatrixXd changes(count(), n * d);
    std::optional<MatrixXd> of_all;
    if (std::isinf(radius_) || !sites_.wide.empty()) of_all = weights(data_near(-1), anomalies, innovations);
    parallel_for(static_cast<int>(n), [&](int a) {
      const MatrixXd near = std::isinf(radius_) ? *of_all : weights(data_near(a), anomalies, innovations);
      for (Index axis = 0; axis < d; ++axis)
        changes.col(axis * n + a) = near.transpose() * velocities[static_cast<std::size_t>(axis)].col(a);
      update_channels(sites_.of_landmark[static_cast<std::size_t>(a)], near);
    });
    if (!sites_.wide.empty()) update_channels(sites_.wide, *of_all);
    for (Index axis = 0; axis < d; ++axis) {
      const MatrixXd change = changes.middleCols(axis * n, n);
      const MatrixXd of_z = by_rows(change, [&](const MatrixXd& part) -> MatrixXd {
        return smooth_change(part);
      });
      for (Index a = 0; a < n; ++a) z_.col(a * d + axis) += of_z.col(a);
    }
  }

  MatrixXd smooth_change(const MatrixXd& change) const {
    static const double tau = std::getenv("TAU") ? std::atof(std::getenv("TAU")) : 0;
    const MatrixXd& root = *model_.root;
    if (tau == 0)
      return root.transpose().triangularView<Eigen::Upper>().solve<Eigen::OnTheRight>(change);
    const double s = specimen_.problem().sigma / specimen_.problem().grid.time;
    MatrixXd k = root.triangularView<Eigen::Lower>() * root.transpose();
    k.diagonal().array() += tau * specimen_.problem().lambda * s * s;
    return k.llt().solve(MatrixXd(change.transpose())).transpose() * root.triangularView<Eigen::Lower>();
  }

  // The unknowns of the momenta along an axis, mapped by blocks of members in parallel.
  template <typename Map>
  MatrixXd by_members(Index axis, const Map& map) const {
    const Index d = dimension(), n = landmarks();
    MatrixXd z0(count(), n);
    for (Index a = 0; a < n; ++a) z0.col(a) = z_.col(a * d + axis);
    return by_rows(z0, map);
  }
  template <typename Map>
  static MatrixXd by_rows(const MatrixXd& all, const Map& map) {
    constexpr Index kRows = 16;
    MatrixXd out(all.rows(), all.cols());
    parallel_for(static_cast<int>((all.rows() + kRows - 1) / kRows), [&](int block) {
      const Index first = block * kRows, rows = std::min(kRows, all.rows() - first);
      out.middleRows(first, rows) = map(all.middleRows(first, rows));
    });
    return out;
  }

  const Specimen& specimen_;
  const Specimen::Model& model_;
  const EnsembleKalmanOptions& options_;
  std::size_t number_;
  double radius_;
  std::vector<Index> first_;  // of the data of each landmark, and their number
  ChannelSites sites_;
  MatrixXd z_;  // m×unknowns
  std::vector<Index> found_;
};

// What is drawn of one specimen, a column for each member that is left.
struct MemberPaths {
  MatrixXd momenta, ends, middles;
  VectorXd log_likelihood, misfit;
  std::vector<std::vector<Points>> paths;
};

MemberPaths final_paths(Members& members, const Specimen& specimen, const EnsembleKalmanOptions& options,
                        const std::function<void()>& on_path) {
  const Index size = specimen.problem().source.size(), m = members.count();
  MemberPaths all{MatrixXd(size, m), MatrixXd(size, m), MatrixXd(size, m), VectorXd(m), VectorXd(m), {}};
  all.paths.resize(static_cast<std::size_t>(m));
  const Index every = std::max<Index>(1, (m + options.paths_kept - 1) / options.paths_kept);
  members.shoot([&](int i, const Specimen::Shot& shot) {
    const std::vector<PhaseState>& states = shot.paths.front().states;
    all.momenta.col(i) = states.front().p.reshaped();
    all.ends.col(i) = states.back().q.reshaped();
    all.middles.col(i) = states[states.size() / 2].q.reshaped();
    all.log_likelihood[i] = shot.log_likelihood;
    all.misfit[i] = shot.residual.squaredNorm() / static_cast<double>(specimen.data());
    if (i % every == 0)
      for (const PhaseState& state : states) all.paths[static_cast<std::size_t>(i)].push_back(state.q);
    on_path();
  });
  return all;
}

}  // namespace

EnsembleDraws sample_ensemble(const PosteriorProblem& problem, const EnsembleKalmanOptions& options) {
  const SerialBlas serial;
  check(problem, options);
  const auto start = std::chrono::steady_clock::now();
  const ParameterSpace space(problem);
  std::atomic<std::int64_t> done = 0;
  const double all = static_cast<double>(problem.specimens.size()) * (options.rounds + 1) * options.members;
  const auto on_path = [&] {
    const std::int64_t now = ++done;
    if (options.on_progress) options.on_progress(static_cast<double>(now) / all);
  };
  EnsembleDraws out;
  for (std::size_t s = 0; s < problem.specimens.size(); ++s) {
    const Specimen specimen(problem.specimens[s]);
    const Specimen::Model model = specimen.model(space.at(VectorXd::Zero(0)));
    const double radius = options.localisation.value_or(std::numeric_limits<double>::infinity());
    out.localisation.push_back(radius);
    Members members(specimen, model, options, s, radius);
    for (int round = 0; round < options.rounds; ++round) members.update(round, on_path);
    MemberPaths paths = final_paths(members, specimen, options, on_path);
    const std::vector<Index>& left = members.found();
    out.draws.momenta.push_back(paths.momenta(Eigen::all, left));
    out.draws.ends.push_back(paths.ends(Eigen::all, left));
    out.draws.middles.push_back(paths.middles(Eigen::all, left));
    out.draws.log_likelihood = paths.log_likelihood(left);
    out.misfit += VectorXd(paths.misfit(left)).mean();
  }
  out.lost = options.members - static_cast<int>(out.draws.momenta.front().cols());
  out.draws.chains = 1;
  out.draws.draws = static_cast<int>(out.draws.momenta.front().cols());
  out.draws.path_evaluations = done;
  out.draws.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace pulson::inference
