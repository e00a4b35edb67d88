#include "minimum.hpp"

#include <algorithm>
#include <limits>

#include "core/secants.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::posterior {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

namespace {

constexpr double kFall = 1e-4;             // Armijo's constant, of what a step should gain
constexpr std::size_t kMinimumWindow = 3;  // of the secants of Gauss–Newton steps

// The search of one specimen.
struct MinimumSearch {
  const Specimen* specimen = nullptr;
  Minimum best;
  VectorXd residual;
  bool begun = false;
  VectorXd to;  // the minimum of the linear model
  Secants secants{kMinimumWindow};
  VectorXd faster;  // than the step, if it has a size
  double part = 1;  // of the step
  bool ended = false, moved = false;
};

class MinimumSearches {
 public:
  MinimumSearches(const std::vector<const Specimen*>& specimens, const Specimen::Model& model,
                  const MinimumOptions& options)
      : model_(model), options_(options), shots_(*specimens.front(), model), all_(specimens.size()) {
    for (std::size_t s = 0; s < specimens.size(); ++s) all_[s].specimen = specimens[s];
  }

  std::vector<Minimum> run(const std::vector<std::vector<VectorXd>>& starts) {
    begin(starts);
    for (int count = 0; count <= options_.most_steps; ++count) {
      linearise();
      if (count < options_.most_steps && !advance()) break;
    }
    std::vector<Minimum> minima;
    for (MinimumSearch& search : all_) minima.push_back(std::move(search.best));
    return minima;
  }

 private:
  // Takes z where it has a path of a cost below a limit. @return of each whether it was taken
  std::vector<char> take(const std::vector<MinimumSearch*>& which, const MatrixXd& z,
                         const std::vector<double>& below) {
    const ShotBatch::Ends ends = shots_.ends(z);
    std::vector<char> taken(which.size());
    for (std::size_t i = 0; i < which.size(); ++i) {
      if (!ends.found[i]) continue;
      const auto l = static_cast<Index>(i);
      VectorXd residual = which[i]->specimen->residual(model_, ends.positions.col(l));
      const double cost = 0.5 * (z.col(l).squaredNorm() + residual.squaredNorm());
      if (!(cost < below[i])) continue;
      taken[i] = 1;
      Minimum& best = which[i]->best;
      best.z = z.col(l);
      best.end = ends.positions.col(l);
      best.cost = cost;
      which[i]->residual = std::move(residual);
      which[i]->begun = which[i]->moved = true;
    }
    return taken;
  }

  void begin(const std::vector<std::vector<VectorXd>>& starts) {
    std::size_t most = 0;
    for (const auto& of_one : starts) most = std::max(most, of_one.size());
    const Index unknowns = shots_.specimen().unknowns();
    for (std::size_t i = 0; i <= most; ++i) {  // at last, rest
      std::vector<MinimumSearch*> tries;
      std::vector<double> below;
      MatrixXd z(unknowns, std::ssize(all_));
      for (std::size_t s = 0; s < all_.size(); ++s) {
        const bool is_start = i < starts[s].size();
        if (!is_start && (i < most || all_[s].begun)) continue;
        z.col(std::ssize(tries)) = is_start ? starts[s][i] : VectorXd(VectorXd::Zero(unknowns));
        below.push_back(all_[s].begun ? all_[s].best.cost : std::numeric_limits<double>::infinity());
        tries.push_back(&all_[s]);
      }
      if (!tries.empty()) take(tries, z.leftCols(std::ssize(tries)), below);
    }
    for (const MinimumSearch& search : all_)
      if (!search.begun)
        throw NumericalError(
            "landmarks at rest have no path: the noise is too strong for the time step; use more `grid.steps`");
  }

  // About the places that are new.
  void linearise() {
    std::vector<MinimumSearch*> new_ones;
    for (MinimumSearch& search : all_)
      if (search.moved) new_ones.push_back(&search);
    MatrixXd z(shots_.specimen().unknowns(), std::ssize(new_ones));
    for (Index i = 0; i < z.cols(); ++i) z.col(i) = new_ones[static_cast<std::size_t>(i)]->best.z;
    std::vector<Specimen::Slopes> slopes = shots_.slopes(z);
    for (std::size_t i = 0; i < new_ones.size(); ++i) {
      MinimumSearch& search = *new_ones[i];
      Minimum& best = search.best;
      search.moved = false;
      if (slopes[i].branches.empty()) throw NumericalError("a path has no derivatives: use more `grid.steps`");
      of_specimen(slopes[i], *search.specimen, best.end);
      best.linear =
          std::make_shared<LinearModel>(*search.specimen, model_, std::move(slopes[i]), search.residual, best.z);
      const LinearAt linear(*best.linear, model_);
      search.to = linear.mean();
      best.gain = best.cost - 0.5 * (search.to.squaredNorm() + linear.residual(search.to).squaredNorm());
      best.converged = best.gain <= options_.tolerance;
      search.ended = best.converged;
      search.part = 1;
      search.faster = search.secants.next(best.z, best.z - search.to);
      if (!search.secants.any()) search.faster.resize(0);
    }
  }

  // The path is that of all; what its end does to the data is of each.
  void of_specimen(Specimen::Slopes& slopes, const Specimen& specimen, const VectorXd& end) const {
    if (&specimen != &shots_.specimen()) slopes.branches.front().by_end = specimen.projection(end);
  }

  // @return whether any has come to a lower cost
  bool advance() {
    for (int halving = 0; halving <= options_.most_halvings; ++halving) {
      std::vector<MinimumSearch*> tries;
      std::vector<double> below;
      MatrixXd z(shots_.specimen().unknowns(), std::ssize(all_));
      for (MinimumSearch& search : all_) {
        if (search.ended || search.moved) continue;
        const Minimum& best = search.best;
        const bool secant = search.faster.size() > 0;
        z.col(std::ssize(tries)) = secant ? search.faster : VectorXd(best.z + search.part * (search.to - best.z));
        below.push_back(best.cost - kFall * search.part * best.gain);
        tries.push_back(&search);
      }
      if (tries.empty()) break;
      const std::vector<char> taken = take(tries, z.leftCols(std::ssize(tries)), below);
      for (std::size_t i = 0; i < tries.size(); ++i) {
        if (!taken[i] && tries[i]->faster.size() == 0) tries[i]->part /= 2;
        tries[i]->faster.resize(0);
      }
    }
    bool any = false;
    for (MinimumSearch& search : all_) {
      any |= search.moved;
      search.ended |= !search.moved;  // no part of the step falls
    }
    return any;
  }

  const Specimen::Model& model_;
  MinimumOptions options_;
  ShotBatch shots_;
  std::vector<MinimumSearch> all_;
};

}  // namespace

std::vector<Minimum> find_minima(const std::vector<const Specimen*>& specimens, const Specimen::Model& model,
                                 const std::vector<std::vector<VectorXd>>& starts, const MinimumOptions& options) {
  return MinimumSearches(specimens, model, options).run(starts);
}

}  // namespace pulson::posterior
