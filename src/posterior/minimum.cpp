#include "minimum.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

#include "core/secants.hpp"
#include "matching/damping.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::posterior {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr std::size_t kMinimumWindow = 3;  // of the secants of Gauss–Newton steps
// Of what a step is to gain by the linear model: with so much it is taken at once, with so much at all. (Of the 24
// searches of specimen_test.cpp one does not converge with 0.1 to 0.9 for the first, nor with 1 to 10 corrections.)
constexpr double kMuchOfGain = 0.5;
constexpr double kLeastOfGain = 1e-4;
constexpr double kRoundingOfCost = 1e-13;  // below this part its differences say nothing

// R of the damping ½μ(z' − z)ᵀR(z' − z). Momenta along directions of small eigenvalues of M = LLᵀ move landmarks little
// to first order, and bend their paths much: of these R is the largest eigenvalue over their own, z0 being taken in the
// right singular vectors of L. Of increments it is 1.
class DampingMetric {
 public:
  DampingMetric(const MatrixXd& root, Index momenta) : dimension_(momenta > 0 ? momenta / root.rows() : 0) {
    if (dimension_ == 0) return;
    const Eigen::SelfAdjointEigenSolver<MatrixXd> eigen(root.transpose() * root);
    modes_ = eigen.eigenvectors();
    const VectorXd& values = eigen.eigenvalues();
    weights_ = values[values.size() - 1] * values.cwiseMax(values[values.size() - 1] * kSingular).cwiseInverse();
  }

  // Cz, C = (I + μR)⁻¹.
  VectorXd apply(double mu, VectorXd z) const {
    const Index n = modes_.rows(), momenta = dimension_ * n;
    if (momenta > 0)
      z.head(momenta) =
          (z.head(momenta).reshaped(dimension_, n) * modes_ * kept(mu).asDiagonal() * modes_.transpose()).reshaped();
    z.tail(z.size() - momenta) /= 1 + mu;
    return z;
  }
  // JCJᵀ
  MatrixXd gram(double mu, const LinearAt& linear) const {
    const MatrixXd of_momenta = linear.by_momenta();
    MatrixXd gram = (linear.gram() - of_momenta * of_momenta.transpose()) / (1 + mu);
    for (Index axis = 0; axis < dimension_; ++axis) {
      const MatrixXd of_axis = of_momenta(Eigen::all, Eigen::seqN(axis, modes_.rows(), dimension_));
      const MatrixXd of_modes = of_axis * modes_;
      gram += of_modes * kept(mu).asDiagonal() * of_modes.transpose();
    }
    return gram;
  }

 private:
  static constexpr double kSingular = 1e-15;
  VectorXd kept(double mu) const { return (1 + mu * weights_.array()).inverse(); }

  Index dimension_;
  MatrixXd modes_;
  VectorXd weights_;
};

// The linear model with the damping added, z where it is made.
class DampedModel {
 public:
  DampedModel(const LinearAt& linear, const DampingMetric& metric, const VectorXd& z, double mu)
      : linear_(linear), metric_(metric), mu_(mu) {
    if (mu == 0) {
      to_ = linear.mean();
      return;
    }
    MatrixXd s = metric.gram(mu, linear);
    s.diagonal().array() += 1;
    factors_.compute(s);
    const VectorXd still = z - metric.apply(mu, z);
    to_ = still + change(linear.residual(still));
  }

  const VectorXd& to() const { return to_; }  // its minimum
  // The least change of z that takes an unforeseen part of the residual out again.
  VectorXd change(const VectorXd& excess) const {
    if (mu_ == 0) return -linear_.transposed(linear_.solve(excess));
    return -metric_.apply(mu_, linear_.transposed(factors_.solve(excess)));
  }

 private:
  const LinearAt& linear_;
  const DampingMetric& metric_;
  double mu_;
  Eigen::LLT<MatrixXd> factors_;  // of I + JCJᵀ, where it is damped
  VectorXd to_;
};

// Where a search is.
struct Place {
  VectorXd z, end, residual;
  double cost = std::numeric_limits<double>::infinity();  // also where there is no path
};

// The search of one specimen, as in matching/gauss_newton.cpp: the valley of the cost may be narrow and bent, and its
// walls are the residuals that the linear model did not foresee. Taking them out again, with the same factors, allows
// far longer steps along it.
class MinimumSearch {
 public:
  MinimumSearch(const Specimen& specimen, const DampingMetric& metric, const MinimumOptions& options)
      : specimen_(&specimen), metric_(&metric), options_(options) {}

  const Specimen& specimen() const { return *specimen_; }
  const Place& at() const { return at_; }
  bool has_begun() const { return at_.z.size() > 0; }
  bool has_ended() const { return ended_; }
  bool has_moved() const { return moved_; }

  // Takes the place where it costs less.
  void begin(Place place) {
    if (place.cost < at_.cost) take(std::move(place));
  }

  void linearise(const Specimen::Model& model, std::shared_ptr<const LinearModel> about) {
    moved_ = false;
    about_ = std::move(about);
    linear_.emplace(*about_, model);
    const VectorXd to = linear_->mean();
    gain_ = gain_at(to);
    if (!std::isfinite(gain_)) throw NumericalError("the derivatives of a path overflow: use more `grid.steps`");
    ended_ = gain_ <= options_.tolerance;
    if (ended_) return;
    faster_ = secants_.next(at_.z, at_.z - to);
    if (!secants_.any() || damping_.mu() > 0) faster_.resize(0);
    propose();
  }

  // Where the cost is wanted next.
  const VectorXd& wanted() const { return faster_.size() > 0 ? faster_ : wanted_; }

  void hear(Place place) {
    if (faster_.size() > 0) {
      faster_.resize(0);
      if (place.cost < at_.cost - kLeastOfGain * gain_) take(std::move(place));
    } else if (place.cost < trial_.cost) {
      // What is corrected less well than by a tenth is corrected as far as it can be.
      const bool is_exhausted = corrections_ > 0 && place.cost > 0.9 * trial_.cost;
      trial_ = std::move(place);
      if (part_of_gain() > kMuchOfGain || is_exhausted || corrections_ == options_.most_corrections) return judge();
      wanted_ = trial_.z + damped_->change(trial_.residual - foreseen_);
      ++corrections_;
    } else {
      judge();
    }
  }

  Minimum result() && {
    return {std::move(at_.z), std::move(at_.end), at_.cost, gain_, gain_ <= options_.tolerance, std::move(about_)};
  }

 private:
  double gain_at(const VectorXd& z) const {
    return at_.cost - 0.5 * (z.squaredNorm() + linear_->residual(z).squaredNorm());
  }

  double part_of_gain() const { return (at_.cost - trial_.cost) / promised_; }

  void take(Place place) {
    at_ = std::move(place);
    moved_ = true;
  }

  void propose() {
    damped_.emplace(*linear_, *metric_, at_.z, damping_.mu());
    wanted_ = damped_->to();
    foreseen_ = linear_->residual(wanted_);
    promised_ = gain_at(wanted_);
    trial_ = {};
    corrections_ = 0;
    ended_ = ended_ || !(promised_ > kRoundingOfCost * at_.cost) || damping_.is_exhausted();
  }

  void judge() {
    const double part = part_of_gain();
    if (part > kLeastOfGain) {
      damping_.accept(part);
      return take(std::move(trial_));
    }
    damping_.refuse();
    propose();
  }

  const Specimen* specimen_;
  const DampingMetric* metric_;
  MinimumOptions options_;
  Place at_;
  std::shared_ptr<const LinearModel> about_;
  std::optional<LinearAt> linear_;
  double gain_ = 0;  // by the linear model, of its minimum
  Secants secants_{kMinimumWindow};
  VectorXd faster_;  // than the step, if it has a size
  matching::Damping damping_;
  std::optional<DampedModel> damped_;
  VectorXd wanted_, foreseen_;  // by the damped model: z, and r there
  double promised_ = 0;
  Place trial_;
  int corrections_ = 0;
  bool ended_ = false, moved_ = false;
};

class MinimumSearches {
 public:
  MinimumSearches(const std::vector<const Specimen*>& specimens, const Specimen::Model& model,
                  const MinimumOptions& options)
      : model_(model),
        options_(options),
        shots_(*specimens.front(), model),
        metric_(*model.root, specimens.front()->momentum_unknowns()) {
    for (const Specimen* specimen : specimens) all_.emplace_back(*specimen, metric_, options);
  }

  std::vector<Minimum> run(const std::vector<std::vector<VectorXd>>& starts) {
    begin(starts);
    for (int count = 0; count <= options_.most_steps; ++count) {
      linearise();
      if (count < options_.most_steps && !advance()) break;
    }
    std::vector<Minimum> minima;
    for (MinimumSearch& search : all_) minima.push_back(std::move(search).result());
    return minima;
  }

 private:
  // @param z a column for each
  std::vector<Place> places(const std::vector<MinimumSearch*>& which, const MatrixXd& z) {
    const ShotBatch::Ends ends = shots_.ends(z);
    std::vector<Place> places(which.size());
    for (std::size_t i = 0; i < which.size(); ++i) {
      if (!ends.found[i]) continue;
      Place& place = places[i];
      place.z = z.col(static_cast<Index>(i));
      place.end = ends.positions.col(static_cast<Index>(i));
      place.residual = which[i]->specimen().residual(model_, place.end);
      const double cost = 0.5 * (place.z.squaredNorm() + place.residual.squaredNorm());
      if (std::isfinite(cost)) place.cost = cost;
    }
    return places;
  }

  void begin(const std::vector<std::vector<VectorXd>>& starts) {
    std::size_t most = 0;
    for (const auto& of_one : starts) most = std::max(most, of_one.size());
    const Index unknowns = shots_.specimen().unknowns();
    for (std::size_t i = 0; i <= most; ++i) {  // at last, rest
      std::vector<MinimumSearch*> tries;
      MatrixXd z(unknowns, std::ssize(all_));
      for (std::size_t s = 0; s < all_.size(); ++s) {
        const bool is_start = i < starts[s].size();
        if (!is_start && (i < most || all_[s].has_begun())) continue;
        z.col(std::ssize(tries)) = is_start ? starts[s][i] : VectorXd(VectorXd::Zero(unknowns));
        tries.push_back(&all_[s]);
      }
      if (tries.empty()) continue;
      std::vector<Place> found = places(tries, z.leftCols(std::ssize(tries)));
      for (std::size_t t = 0; t < tries.size(); ++t) tries[t]->begin(std::move(found[t]));
    }
    for (const MinimumSearch& search : all_)
      if (!search.has_begun())
        throw NumericalError(
            "landmarks at rest have no path: the noise is too strong for the time step; use more `grid.steps`");
  }

  // About the places that are new.
  void linearise() {
    std::vector<MinimumSearch*> new_ones;
    for (MinimumSearch& search : all_)
      if (search.has_moved()) new_ones.push_back(&search);
    MatrixXd z(shots_.specimen().unknowns(), std::ssize(new_ones));
    for (Index i = 0; i < z.cols(); ++i) z.col(i) = new_ones[static_cast<std::size_t>(i)]->at().z;
    std::vector<Specimen::Slopes> slopes = shots_.slopes(z);
    for (std::size_t i = 0; i < new_ones.size(); ++i) {
      MinimumSearch& search = *new_ones[i];
      if (slopes[i].branches.empty()) throw NumericalError("a path has no derivatives: use more `grid.steps`");
      of_specimen(slopes[i], search.specimen(), search.at().end);
      search.linearise(model_, std::make_shared<LinearModel>(search.specimen(), model_, std::move(slopes[i]),
                                                             search.at().residual, search.at().z));
    }
  }

  // The path is that of all; what its end does to the data is of each.
  void of_specimen(Specimen::Slopes& slopes, const Specimen& specimen, const VectorXd& end) const {
    if (&specimen != &shots_.specimen()) slopes.branches.front().by_end = specimen.projection(end);
  }

  // @return whether any has come to a lower cost
  bool advance() {
    for (;;) {
      std::vector<MinimumSearch*> tries;
      for (MinimumSearch& search : all_)
        if (!search.has_ended() && !search.has_moved()) tries.push_back(&search);
      if (tries.empty()) break;
      MatrixXd z(shots_.specimen().unknowns(), std::ssize(tries));
      for (Index i = 0; i < z.cols(); ++i) z.col(i) = tries[static_cast<std::size_t>(i)]->wanted();
      std::vector<Place> found = places(tries, z);
      for (std::size_t t = 0; t < tries.size(); ++t) tries[t]->hear(std::move(found[t]));
    }
    return std::any_of(all_.begin(), all_.end(), [](const MinimumSearch& search) { return search.has_moved(); });
  }

  const Specimen::Model& model_;
  MinimumOptions options_;
  ShotBatch shots_;
  DampingMetric metric_;
  std::vector<MinimumSearch> all_;
};

}  // namespace

std::vector<Minimum> find_minima(const std::vector<const Specimen*>& specimens, const Specimen::Model& model,
                                 const std::vector<std::vector<VectorXd>>& starts, const MinimumOptions& options) {
  return MinimumSearches(specimens, model, options).run(starts);
}

}  // namespace pulson::posterior
