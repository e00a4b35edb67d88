#include "pulson/inference/ensemble_kalman.hpp"

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <limits>
#include <numeric>

#include <fmt/core.h>

#include "core/factorisations.hpp"
#include "localisation.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/inference/diagnostics.hpp"
#include "random/normals.hpp"
#include "reference.hpp"

namespace pulson::inference {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr int kFewestMembers = 20;
constexpr double kRoundOff = 1e-9;

// A path that goes so many times as far as the median one has left the range that the time steps resolve.
constexpr double kFar = 10;

constexpr int kMostRounds = 200;  // beyond those asked for

void check(const PosteriorProblem& problem, const EnsembleKalmanOptions& options) {
  if (!problem.tree.empty()) throw InputError("an ensemble Kalman smoother takes independent paths, not a tree");
  if (!problem.parameters.empty())
    throw InputError(fmt::format("an ensemble Kalman smoother samples no parameters of the models; here is {}",
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

const matching::LandmarkTerm& landmark_data(const Specimen& specimen) {
  const matching::LandmarkTerm* term = specimen.problem().data->landmarks();
  if (term == nullptr) throw InputError("an ensemble Kalman smoother needs landmarks as data");
  return *term;
}

// Independent random numbers for the unknowns of each specimen, and for the errors of its data.
enum class Stream : std::uint64_t { kUnknowns, kErrors };

// Standard normal numbers, m×count, with the mean 0 over the members and the variance 1. @param first path number
MatrixXd centred_normals(std::uint64_t seed, Stream stream, std::size_t specimen, int first, Index members,
                         Index count) {
  const std::uint64_t path = (static_cast<std::uint64_t>(stream) << 63U) +
                             (static_cast<std::uint64_t>(specimen) << 32U) + static_cast<std::uint64_t>(first);
  MatrixXd numbers(members, count);
  parallel_for(static_cast<int>(members), [&](int i) {
    numbers.row(i) = standard_normals(seed, path + static_cast<std::uint64_t>(i), 1, static_cast<int>(count));
  });
  numbers.rowwise() -= numbers.colwise().mean().eval();
  return numbers * std::sqrt(static_cast<double>(members) / static_cast<double>(members - 1));
}

// The members of one specimen, a row each of unknowns z ~ N(0, I) as Specimen has them.
class Members {
 public:
  Members(const Specimen& specimen, const Specimen::Model& model, const EnsembleKalmanOptions& options,
          std::size_t number)
      : specimen_(specimen),
        model_(model),
        options_(options),
        number_(number),
        data_(landmark_data(specimen), specimen.problem().source),
        z_(centred_normals(options.seed, Stream::kUnknowns, number, 0, options.members, specimen.unknowns())),
        ids_(static_cast<std::size_t>(options.members)) {
    std::iota(ids_.begin(), ids_.end(), 0);
  }

  const std::vector<int>& ids() const { return ids_; }  ///< which members are left
  double radius() const { return radius_; }             ///< after the first round

  /// Integrates the path of each member, and drops those that have none.
  /// @param visit (row, shot), in parallel @return the rows that are left
  template <typename Visit>
  std::vector<Index> shoot(const Visit& visit) {
    VectorXd moved = VectorXd::Constant(count(), std::numeric_limits<double>::infinity());
    parallel_for(static_cast<int>(count()), [&](int i) {
      const auto shot = specimen_.shoot(model_, z_.row(i).transpose());
      visit(i, shot);
      if (!shot) return;
      const double far = (shot->paths.front().final().q - specimen_.problem().source).colwise().norm().maxCoeff();
      if (std::isfinite(far)) moved[i] = far;
    });
    std::vector<Index> left;
    std::vector<int> ids;
    const double far = kFar * quantile(moved, 0.5);
    for (Index i = 0; i < count(); ++i)
      if (std::isfinite(moved[i]) && moved[i] <= far) {
        left.push_back(i);
        ids.push_back(ids_[static_cast<std::size_t>(i)]);
      }
    if (2 * std::ssize(left) < options_.members)
      throw NumericalError(fmt::format("only {} of {} members have a path; take more `grid.steps`, or a larger lambda",
                                       left.size(), options_.members));
    z_ = MatrixXd(z_(left, Eigen::all));
    ids_ = std::move(ids);
    return left;
  }

  double assimilated() const { return assimilated_; }  ///< of log p(y | x)

  void update(int round, const std::function<void()>& on_path) {
    MatrixXd residuals(count(), specimen_.data());
    const std::vector<Index> left = shoot([&](int i, const std::optional<Specimen::Shot>& shot) {
      if (shot) residuals.row(i) = shot->residual.transpose();
      on_path();
    });
    residuals = MatrixXd(residuals(left, Eigen::all));
    const MatrixXd errors =
        centred_normals(options_.seed, Stream::kErrors, number_, round * options_.members, count(), specimen_.data());
    const double alpha = find_inflation(residuals.rowwise().squaredNorm());
    const MatrixXd innovations = std::sqrt(alpha) * errors - residuals;
    residuals.rowwise() -= residuals.colwise().mean().eval();
    if (round == 0) localise(residuals);
    assimilate(alpha, residuals, innovations);
  }

 private:
  Index count() const { return z_.rows(); }

  // α of Σ in this round, of the members' |r|².
  double find_inflation(const VectorXd& misfits) {
    const auto data = static_cast<double>(specimen_.data());
    const double mean = misfits.mean(), variance = (misfits.array() - mean).square().mean();
    double part = std::min(1.0 / options_.rounds, std::max(data / mean, std::sqrt(2 * data / variance)));
    const double left = 1 - assimilated_;
    if (part >= (1 - kRoundOff) * left) {
      assimilated_ = 1;
      return 1 / left;
    }
    assimilated_ += part;
    return 1 / part;
  }

  void localise(const MatrixXd& anomalies) {
    radius_ = options_.localisation ? *options_.localisation : automatic_localisation(data_, anomalies);
    is_local_ = std::isfinite(radius_);
    sites_ = channel_sites(*model_.system.noise, specimen_.problem().source, radius_ / 4);
    if (!is_local_) return;
    const double of_all = resolved_data(data_.all(1), anomalies);
    weight_of_all_ = std::min(1.0, wanted_data(count(), specimen_.problem().source.rows()) / of_all);
  }

  // W, m×m: an unknown there, a column of the ensemble, changes by Wᵀ times that column. Columns of W sum to 0.
  MatrixXd weights(const LocalData& local, double alpha, const MatrixXd& anomalies, const MatrixXd& innovations) const {
    const MatrixXd predicted = anomalies(Eigen::all, local.rows) * local.roots.asDiagonal();
    const MatrixXd missed = innovations(Eigen::all, local.rows) * local.roots.asDiagonal();
    MatrixXd gram = predicted * predicted.transpose();
    gram.diagonal().array() += alpha * static_cast<double>(count() - 1);
    return gram.llt().solve(predicted * missed.transpose());
  }

  void assimilate(double alpha, const MatrixXd& anomalies, const MatrixXd& innovations) {
    const Index d = specimen_.problem().source.rows(), n = specimen_.problem().source.cols();
    const auto upper = model_.root->transpose().triangularView<Eigen::Upper>();
    std::vector<MatrixXd> velocities;  // of each axis, m×N, times √λ
    for (Index axis = 0; axis < d; ++axis)
      velocities.push_back(by_rows(of_axis(axis), [&](const MatrixXd& rows) -> MatrixXd { return rows * upper; }));
    MatrixXd of_all;
    if (!is_local_ || !sites_.wide.empty()) of_all = weights(data_.all(weight_of_all_), alpha, anomalies, innovations);
    std::vector<MatrixXd> changes(static_cast<std::size_t>(d), MatrixXd(count(), n));
    parallel_for(static_cast<int>(n), [&](int a) {
      const MatrixXd near = is_local_ ? weights(data_.near(a, radius_), alpha, anomalies, innovations) : of_all;
      for (std::size_t axis = 0; axis < changes.size(); ++axis)
        changes[axis].col(a) = near.transpose() * velocities[axis].col(a);
      update_channels(sites_.of_landmark[static_cast<std::size_t>(a)], near);
    });
    if (!sites_.wide.empty()) update_channels(sites_.wide, of_all);
    for (Index axis = 0; axis < d; ++axis)
      of_axis(axis) += by_rows(changes[static_cast<std::size_t>(axis)],
                               [&](const MatrixXd& rows) -> MatrixXd { return upper.solve<Eigen::OnTheRight>(rows); });
  }

  void update_channels(const std::vector<Index>& channels, const MatrixXd& weights) {
    std::vector<Index> columns;
    for (Index k = 0; k < specimen_.problem().grid.steps; ++k)
      for (const Index channel : channels)
        columns.push_back(specimen_.momentum_unknowns() + k * specimen_.channels() + channel);
    const MatrixXd own = z_(Eigen::all, columns);
    z_(Eigen::all, columns) = own + weights.transpose() * own;
  }

  // The unknowns of the momenta along an axis, m×N.
  Eigen::Map<MatrixXd, 0, Eigen::OuterStride<>> of_axis(Index axis) {
    const Index d = specimen_.problem().source.rows();
    return {z_.data() + axis * count(), count(), specimen_.problem().source.cols(), Eigen::OuterStride<>(d * count())};
  }

  // Maps blocks of members in parallel.
  template <typename Map>
  static MatrixXd by_rows(const Eigen::Ref<const MatrixXd>& all, const Map& map) {
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
  LocalWeights data_;
  double radius_ = 0;
  double assimilated_ = 0;
  bool is_local_ = false;
  double weight_of_all_ = 1;  // of data for channels that act everywhere
  ChannelSites sites_;
  MatrixXd z_;  // m×unknowns
  std::vector<int> ids_;
};

// What is drawn of one specimen, a column for each member, whether it is left or not.
struct MemberPaths {
  std::vector<char> is_left;
  MatrixXd momenta, ends, middles;
  VectorXd log_likelihood, misfit;
  std::vector<std::vector<Points>> paths;  ///< empty: not kept
};

MemberPaths final_paths(Members& members, const Specimen& specimen, const EnsembleKalmanOptions& options,
                        const std::function<void()>& on_path) {
  const Index size = specimen.problem().source.size(), m = options.members;
  const auto count = static_cast<std::size_t>(m);
  MemberPaths all{
      std::vector<char>(count), MatrixXd(size, m), MatrixXd(size, m), MatrixXd(size, m), VectorXd(m), VectorXd(m), {}};
  all.paths.resize(count);
  const int every = std::max(1, (options.members + options.paths_kept - 1) / options.paths_kept);
  const std::vector<int> ids = members.ids();
  members.shoot([&](int row, const std::optional<Specimen::Shot>& shot) {
    on_path();
    if (!shot) return;
    const int i = ids[static_cast<std::size_t>(row)];
    const std::vector<PhaseState>& states = shot->paths.front().states;
    all.momenta.col(i) = states.front().p.reshaped();
    all.ends.col(i) = states.back().q.reshaped();
    all.middles.col(i) = states[states.size() / 2].q.reshaped();
    all.log_likelihood[i] = shot->log_likelihood;
    all.misfit[i] = shot->residual.squaredNorm() / static_cast<double>(specimen.data());
    if (i % every == 0)
      for (const PhaseState& state : states) all.paths[static_cast<std::size_t>(i)].push_back(state.q);
  });
  for (const int i : members.ids()) all.is_left[static_cast<std::size_t>(i)] = 1;
  return all;
}

// The members that are left in all specimens.
void gather(std::vector<MemberPaths>& specimens, EnsembleDraws& out) {
  std::vector<Index> left;
  for (std::size_t i = 0; i < specimens.front().is_left.size(); ++i)
    if (std::all_of(specimens.begin(), specimens.end(), [&](const MemberPaths& of) { return of.is_left[i] != 0; })) {
      if (!specimens.front().paths[i].empty()) out.draws.kept.push_back(static_cast<int>(left.size()));
      left.push_back(static_cast<Index>(i));
    }
  if (left.size() < kFewestMembers)
    throw NumericalError(fmt::format("only {} members have paths to all targets", left.size()));
  out.lost = static_cast<int>(specimens.front().is_left.size() - left.size());
  out.draws.chains = 1;
  out.draws.draws = static_cast<int>(left.size());
  out.draws.log_likelihood = VectorXd::Zero(std::ssize(left));
  for (MemberPaths& of : specimens) {
    out.draws.momenta.emplace_back(of.momenta(Eigen::all, left));
    out.draws.ends.emplace_back(of.ends(Eigen::all, left));
    out.draws.middles.emplace_back(of.middles(Eigen::all, left));
    out.draws.log_likelihood += VectorXd(of.log_likelihood(left));
    out.misfit += VectorXd(of.misfit(left)).mean() / static_cast<double>(specimens.size());
    std::vector<std::vector<Points>>& kept = out.draws.paths.emplace_back();
    for (const int column : out.draws.kept)
      kept.push_back(std::move(of.paths[static_cast<std::size_t>(left[static_cast<std::size_t>(column)])]));
  }
}

}  // namespace

EnsembleDraws sample_ensemble(const PosteriorProblem& problem, const EnsembleKalmanOptions& options) {
  const SerialBlas serial;
  check(problem, options);
  const auto start = std::chrono::steady_clock::now();
  std::atomic<std::int64_t> done = 0;
  const auto on_path = [&] { ++done; };
  const auto report = [&](double specimens) {
    if (options.on_progress) options.on_progress(specimens / static_cast<double>(problem.specimens.size()));
  };
  EnsembleDraws out;
  std::vector<MemberPaths> specimens;
  for (std::size_t s = 0; s < problem.specimens.size(); ++s) {
    const Specimen specimen(problem.specimens[s]);
    const Specimen::Model model = specimen.model(ParameterSpace(problem).at(VectorXd::Zero(0)));
    Members members(specimen, model, options, s);
    for (int round = 0; members.assimilated() < 1; ++round) {
      if (round == options.rounds + kMostRounds)
        throw NumericalError(
            fmt::format("the members are too far from the target after {} rounds; a larger sigma or a smaller lambda "
                        "brings them nearer",
                        round));
      members.update(round, on_path);
      out.rounds = std::max(out.rounds, round + 1);
      report(static_cast<double>(s) + members.assimilated());
    }
    out.localisation.push_back(members.radius());
    specimens.push_back(final_paths(members, specimen, options, on_path));
  }
  gather(specimens, out);
  out.draws.path_evaluations = done;
  out.draws.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  return out;
}

}  // namespace pulson::inference
