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
constexpr double kViaSoftness = 4;  // soft enough to move, firm enough to stay by the way that was begun
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
  explicit FlowGaussNewton(const FlowProblem& problem)
      : problem_(problem),
        kernel_(problem.kernel),
        count_(problem.source.cols()),
        steps_(problem.grid.steps),
        dt_(problem.grid.dt()),
        weight_(problem.lambda / problem.grid.time) {
    for (const MatrixXd& precision : problem.precisions) {
      precisions_.emplace_back(precision);
      largest_ = std::max(largest_, precision.trace());
    }
    // A coordinate that was not observed has the variance of a thousand others' deviations.
    for (const Block& precision : precisions_)
      variances_.push_back((precision + 1e-6 * largest_ * Block::Identity()).inverse());
  }

  // Zero momenta where no way begins.
  FlowStart run(const Points* via) {
    int iterations = via != nullptr ? begin_via(*via) : 0;
    double softness = std::max(1.0, kViaSoftness);
    if (via == nullptr) {
      fields_.assign(static_cast<std::size_t>(steps_), {problem_.source, Points::Zero(d, count_)});
      // The deviation of a coordinate in units of what the data allow.
      softness =
          std::max(1.0, kFirstSigma * root_mean_square(problem_.source - problem_.target) * std::sqrt(largest_ / d));
    }
    std::optional<Path> path = flow(fields_);
    if (!path) return {Points::Zero(d, count_), iterations};
    path_ = std::move(*path);
    iterations += run_stage(softness);
    while (softness > 1) {
      softness = std::max(1.0, softness / kSigmaRatio);
      iterations += run_stage(softness);
    }
    return {gauss_newton_fields(softness).front().momenta, iterations};
  }

 private:
  using Block = Eigen::Matrix<double, d, d>;
  using Blocks = std::vector<Block>;
  using Vector = Eigen::Matrix<double, d, 1>;

  struct Path {
    std::vector<Points> q;       // q_1 … q_K
    std::vector<Points> moved;   // v_k(q_{k+1})
    std::vector<Blocks> slopes;  // F_k
    double energy = 0;           // ½ Σ_k Δt |v_k|²
  };

  double cost(const Path& path, double softness) const {
    double data = 0;
    for (Index a = 0; a < count_; ++a) {
      const Vector misfit = path.q.back().col(a) - problem_.target.col(a);
      data += misfit.dot(precisions_[static_cast<std::size_t>(a)] * misfit);
    }
    return weight_ * path.energy + 0.5 * data / (softness * softness);
  }

  // The fields of the ways there and on, each in about half of the steps.
  int begin_via(const Points& via) {
    const int half = std::max(1, steps_ / 2);
    FlowProblem there{kernel_, {half * dt_, half}, problem_.lambda, problem_.source, via, problem_.precisions};
    FlowProblem on{
        kernel_, {(steps_ - half) * dt_, steps_ - half}, problem_.lambda, via, problem_.target, problem_.precisions};
    FlowGaussNewton first(there);
    int iterations = first.run(nullptr).iterations;
    fields_ = std::move(first.fields_);
    if (on.grid.steps == 0) return iterations;
    on.source = first.path_.q.empty() ? problem_.source : first.path_.q.back();
    FlowGaussNewton second(on);
    iterations += second.run(nullptr).iterations;
    fields_.insert(fields_.end(), second.fields_.begin(), second.fields_.end());
    return iterations;
  }

  int run_stage(double softness) {
    const double enough = softness > 1 ? kStageGain : kLastGain;
    for (int iteration = 1; iteration <= kMaxIterationsPerStage; ++iteration) {
      const double before = cost(path_, softness);
      if (!improve(softness, before)) return iteration;
      const double after = cost(path_, softness);
      if (before - after <= enough * after) return iteration;
    }
    return kMaxIterationsPerStage;
  }

  // One Gauss–Newton step, halved until it lowers the cost.
  bool improve(double softness, double before) {
    const Fields full = gauss_newton_fields(softness);
    double part = 1;
    for (int halvings = 0; halvings < kMostHalvings; ++halvings, part /= 2) {
      Fields trial = part == 1 ? full : blend(part, full);
      std::optional<Path> path = flow(trial);
      if (!path || !(cost(*path, softness) < before)) continue;
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

  Fields gauss_newton_fields(double softness) const {
    const std::vector<Blocks> phi = propagators();
    MatrixXd system = MatrixXd::Zero(d * count_, d * count_);
    Points misfit = path_.q.back() - problem_.target;
    for (std::size_t k = 0; k < phi.size(); ++k) add_step(phi[k], path_.q[k], path_.moved[k], system, misfit);
    system /= weight_;
    for (Index a = 0; a < count_; ++a)
      system.template block<d, d>(a * d, a * d) += softness * softness * variances_[static_cast<std::size_t>(a)];
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

  const FlowProblem& problem_;
  const KernelOperator& kernel_;
  Index count_;
  int steps_;
  double dt_;
  double weight_;
  Blocks precisions_;
  Blocks variances_;
  double largest_ = 0;  // of the precisions' traces
  Fields fields_;
  Path path_;
};

}  // namespace

FlowStart flow_start(const FlowProblem& problem, const Points* via) {
  if (problem.source.rows() == 1) return FlowGaussNewton<1>(problem).run(via);
  return problem.source.rows() == 2 ? FlowGaussNewton<2>(problem).run(via) : FlowGaussNewton<3>(problem).run(via);
}

}  // namespace pulson
