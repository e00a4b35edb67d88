#include "flow_start.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace pulson {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr double kFirstSigma = 0.2;  // of the distance that the landmarks have to go
constexpr double kSigmaRatio = 4;
constexpr int kMaxIterationsPerStage = 30;
constexpr double kStageGain = 1e-2;  // a stage ends where an iteration lowers the cost by less than this part of it
constexpr double kLastGain = 1e-5;
constexpr int kMostHalvings = 10;
constexpr int kMaxNewton = 30;
constexpr double kSmallestDeterminant = 0.05;  // of I − Δt∇v: nearer to singular the step is refused

// The fields of all steps: v_k(x) = Σ_b K(x − centres_b) momenta_b.
struct Field {
  Points centres;
  Points momenta;
};
using Fields = std::vector<Field>;

double root_mean_square(const Points& difference) {
  return std::sqrt(difference.squaredNorm() / static_cast<double>(difference.cols()));
}

template <int d>
class FlowGaussNewton {
 public:
  explicit FlowGaussNewton(const MatchingProblem& problem)
      : problem_(problem),
        kernel_(problem.system.kernel),
        count_(problem.source.cols()),
        steps_(problem.grid.steps),
        dt_(problem.grid.dt()),
        weight_(problem.lambda / problem.grid.time) {}

  FlowStart run() {
    fields_.assign(static_cast<std::size_t>(steps_), {problem_.source, Points::Zero(d, count_)});
    std::optional<Path> rest = flow(fields_);
    if (!rest) return {Points::Zero(d, count_), 0};
    path_ = std::move(*rest);
    double sigma = std::max(problem_.sigma, kFirstSigma * root_mean_square(problem_.source - problem_.target));
    int iterations = run_stage(sigma);
    while (sigma > problem_.sigma) {
      sigma = std::max(problem_.sigma, sigma / kSigmaRatio);
      iterations += run_stage(sigma);
    }
    return {gauss_newton_fields(sigma).front().momenta, iterations};
  }

 private:
  using Block = Eigen::Matrix<double, d, d>;
  using Blocks = std::vector<Block>;

  struct Path {
    std::vector<Points> q;       // q_1 … q_K
    std::vector<Points> moved;   // v_k(q_{k+1})
    std::vector<Blocks> slopes;  // F_k
    double energy = 0;           // ½ Σ_k Δt |v_k|²
  };

  double cost(const Path& path, double sigma) const {
    return weight_ * path.energy + 0.5 * (path.q.back() - problem_.target).squaredNorm() / (sigma * sigma);
  }

  int run_stage(double sigma) {
    const double enough = sigma > problem_.sigma ? kStageGain : kLastGain;
    for (int iteration = 1; iteration <= kMaxIterationsPerStage; ++iteration) {
      const double before = cost(path_, sigma);
      if (!improve(sigma, before)) return iteration;
      const double after = cost(path_, sigma);
      if (before - after <= enough * after) return iteration;
    }
    return kMaxIterationsPerStage;
  }

  // One Gauss–Newton step, halved until it lowers the cost.
  bool improve(double sigma, double before) {
    const Fields full = gauss_newton_fields(sigma);
    double part = 1;
    for (int halvings = 0; halvings < kMostHalvings; ++halvings, part /= 2) {
      Fields trial = part == 1 ? full : blend(part, full);
      std::optional<Path> path = flow(trial);
      if (!path || !(cost(*path, sigma) < before)) continue;
      fields_ = std::move(trial);
      path_ = std::move(*path);
      return true;
    }
    return false;
  }

  // (1 − part)·fields_ + part·full: the kernels of both.
  Fields blend(double part, const Fields& full) const {
    Fields mixed(full.size());
    for (std::size_t k = 0; k < full.size(); ++k) {
      const Index old = fields_[k].centres.cols();
      mixed[k].centres.resize(d, old + count_);
      mixed[k].momenta.resize(d, old + count_);
      mixed[k].centres << fields_[k].centres, full[k].centres;
      mixed[k].momenta << (1 - part) * fields_[k].momenta, part * full[k].momenta;
    }
    return mixed;
  }

  // The path of the landmarks through the fields; none where a step has no safe solution.
  std::optional<Path> flow(const Fields& fields) const {
    Path path;
    Points q = problem_.source;
    for (const Field& field : fields) {
      if (!advance(field, q, path)) return std::nullopt;
      path.energy +=
          0.5 * dt_ * field.momenta.cwiseProduct(kernel_.apply(field.centres, field.centres, field.momenta)).sum();
    }
    return path;
  }

  // Newton for each landmark on q⁺ = q + Δt v(q⁺).
  bool advance(const Field& field, Points& q, Path& path) const {
    const Points start = q;
    const double scale = std::max(start.cwiseAbs().maxCoeff(), 1e-300);
    MatrixXd gradient;
    for (int turn = 0; turn < kMaxNewton; ++turn) {
      const Points velocity = kernel_.apply_with_jacobian(q, field.centres, field.momenta, gradient);
      Blocks slopes(static_cast<std::size_t>(count_));
      double largest = 0;
      for (Index a = 0; a < count_; ++a) {
        const Block matrix = Block::Identity() - dt_ * Eigen::Map<const Block>(gradient.col(a).data());
        if (!(matrix.determinant() > kSmallestDeterminant)) return false;
        slopes[static_cast<std::size_t>(a)] = matrix.inverse();
        const Eigen::Matrix<double, d, 1> correction =
            slopes[static_cast<std::size_t>(a)] * (start.col(a) + dt_ * velocity.col(a) - q.col(a));
        q.col(a) += correction;
        largest = std::max(largest, correction.cwiseAbs().maxCoeff());
      }
      if (largest <= 1e-13 * scale) {
        path.q.push_back(q);
        path.moved.push_back(velocity);
        path.slopes.push_back(std::move(slopes));
        return true;
      }
    }
    return false;
  }

  // Φ_k for all k.
  std::vector<Blocks> propagators() const {
    std::vector<Blocks> phi(static_cast<std::size_t>(steps_));
    Blocks product(static_cast<std::size_t>(count_), Block::Identity());
    for (std::size_t k = phi.size(); k-- > 0;) {
      for (std::size_t a = 0; a < product.size(); ++a) product[a] = product[a] * path_.slopes[k][a];
      phi[k] = product;
    }
    return phi;
  }

  Fields gauss_newton_fields(double sigma) const {
    const std::vector<Blocks> phi = propagators();
    MatrixXd system = MatrixXd::Zero(d * count_, d * count_);
    Points misfit = path_.q.back() - problem_.target;
    for (std::size_t k = 0; k < phi.size(); ++k) add_step(phi[k], path_.q[k], path_.moved[k], system, misfit);
    system /= weight_;
    system.diagonal().array() += sigma * sigma;
    const Eigen::LLT<Eigen::Ref<MatrixXd>> factors(system);
    const Points eta = factors.solve(VectorXd(misfit.reshaped())).reshaped(d, count_);
    Fields fields(phi.size());
    for (std::size_t k = 0; k < phi.size(); ++k) {
      fields[k] = {path_.q[k], Points(d, count_)};
      for (Index a = 0; a < count_; ++a)
        fields[k].momenta.col(a) = -phi[k][static_cast<std::size_t>(a)].transpose() * eta.col(a) / weight_;
    }
    return fields;
  }

  // Lower triangle of Δt Φ K Φᵀ, and the misfit less what the present field already does.
  void add_step(const Blocks& phi, const Points& q, const Points& moved, MatrixXd& system, Points& misfit) const {
    const MatrixXd gram = dt_ * kernel_.gram(q, q);
    for (Index b = 0; b < count_; ++b) {
      const auto column = static_cast<std::size_t>(b);
      misfit.col(b) -= dt_ * phi[column] * moved.col(b);
      for (Index a = b; a < count_; ++a)
        system.template block<d, d>(a * d, b * d).noalias() +=
            gram(a, b) * (phi[static_cast<std::size_t>(a)] * phi[column].transpose());
    }
  }

  const MatchingProblem& problem_;
  const KernelOperator& kernel_;
  Index count_;
  int steps_;
  double dt_;
  double weight_;
  Fields fields_;
  Path path_;
};

}  // namespace

FlowStart flow_start(const MatchingProblem& problem) {
  if (problem.source.rows() == 1) return FlowGaussNewton<1>(problem).run();
  return problem.source.rows() == 2 ? FlowGaussNewton<2>(problem).run() : FlowGaussNewton<3>(problem).run();
}

}  // namespace pulson
