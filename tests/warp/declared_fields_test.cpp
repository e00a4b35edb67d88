// What noise models declare of their displacement, as maps of space: fields carry landmarks like other points, never
// fold, and are the flow that an integration by plain loops gives.

#include <cmath>
#include <functional>
#include <stdexcept>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <gtest/gtest.h>

#include "material_flow_examples.hpp"
#include "noise_specs.hpp"
#include "pulson/noise/differentiated_noise.hpp"

namespace pulson::warp {
namespace {

using Eigen::Vector2d;

std::vector<std::string> every_noise() {
  std::vector<std::string> all = rows_and_their_sum();
  for (const std::string fields : {"grid,count=2", "cos", "bump,center=0.2/0.1,width=0.7"})
    all.push_back("p-sd:beta=0.5,fields=" + fields);
  all.emplace_back("kunita:beta=0.5,width=0.6+p-sd:beta=0.3,fields=cos+potential:beta=0.2,gamma=0.5");
  return all;
}

class DeclaredDisplacement : public testing::TestWithParam<std::string> {
 protected:
  static constexpr double kMomentum = 0.3;
  static constexpr int kFinest = 80;

  // Of one path of the increments, given in finer or fewer steps.
  Motion motion(const std::string& integrator, int steps) const {
    Landmarks shape;
    shape.points = spread_landmarks(2);
    const StochasticSystem system{make_kernel("gaussian:alpha=0.7", Points()), make_noise(GetParam(), shape)};
    const int channels = system.noise->channels(2, 7);
    const Eigen::MatrixXd finest = std::sqrt(0.3 / kFinest) * random_points(channels, kFinest, 9);
    Eigen::MatrixXd increments = Eigen::MatrixXd::Zero(channels, steps);
    for (int k = 0; k < kFinest; ++k) increments.col(k * steps / kFinest) += finest.col(k);
    return move(integrator, system, {shape.points, kMomentum * random_points(2, 7, 2)}, {1, steps}, increments);
  }
};

INSTANTIATE_TEST_SUITE_P(Table, DeclaredDisplacement, testing::ValuesIn(every_noise()),
                         [](const auto& instance) { return test_name(instance.param); });

TEST_P(DeclaredDisplacement, CarriesLandmarksAndFoldsNothingWhereItIsAField) {
  const Points labels = 1.5 * random_points(2, 60, 3);
  for (const std::string integrator : {"variational", "variational-2", "midpoint", "heun"})
    for (const int steps : {20, 40, kFinest}) {
      const Motion motion = this->motion(integrator, steps);
      const MaterialFlow flow = motion.flow();
      SCOPED_TRACE(integrator + " in " + std::to_string(steps) + " steps");
      EXPECT_LE((flow.end(motion.path.initial().q) - motion.path.final().q).norm(), 1e-11);
      if (motion.system.noise->traits().displacement.has_landmarks()) continue;
      EXPECT_TRUE(flow.is_diffeomorphic());
      const MovedPoints moved = flow.end_with_gradients(labels);
      EXPECT_GT(moved.jacobians().minCoeff(), 0);
      EXPECT_EQ(moved.folded_fraction(), 0);
    }
}

// ---- an independent integration

// A noise of fields and, at a place, its velocity for the rates w of its channels and what compensates it.
struct FieldsByHand {
  std::string spec;
  std::function<Vector2d(const Vector2d& x, const Points& q, const Eigen::VectorXd& w)> noise;
  std::function<Vector2d(const Vector2d& x, const Points& q)> compensation;
};

// Σ φ_f(x) w_f and ¼ Σ φ_f ∇φ_f for bumps φ = β exp(−|x − c|²/width²) about centres.
Vector2d bumps(const Vector2d& x, const Points& centres, double beta, double width, const Eigen::VectorXd& w) {
  Vector2d sum = Vector2d::Zero();
  for (int b = 0; b < centres.cols(); ++b) {
    const double k = std::exp(-(x - centres.col(b)).squaredNorm() / (width * width));
    sum += beta * k * w.segment<2>(2 * b);
  }
  return sum;
}
Vector2d bump_compensation(const Vector2d& x, const Points& centres, double beta, double width) {
  Vector2d sum = Vector2d::Zero();
  for (int b = 0; b < centres.cols(); ++b) {
    const Vector2d z = x - centres.col(b);
    const double k = std::exp(-z.squaredNorm() / (width * width));
    sum += 0.25 * beta * beta * k * (-2 * k / (width * width)) * z;
  }
  return sum;
}

// The fields about moving landmarks change by the landmarks' own noise, too: ¼β² Σ_b ∇k (k − 1).
Vector2d kunita_compensation(const Vector2d& x, const Points& q, double beta, double width) {
  Vector2d sum = Vector2d::Zero();
  for (int b = 0; b < q.cols(); ++b) {
    const Vector2d z = x - q.col(b);
    const double k = std::exp(-z.squaredNorm() / (width * width));
    sum += 0.25 * beta * beta * (k - 1) * (-2 * k / (width * width)) * z;
  }
  return sum;
}

Vector2d cosines(const Vector2d& x, double beta, double wavenumber, const Eigen::VectorXd& w) {
  return beta * (std::cos(wavenumber * x[0]) * w.segment<2>(0) + std::cos(wavenumber * x[1]) * w.segment<2>(2));
}
Vector2d cosine_compensation(const Vector2d& x, double beta, double wavenumber) {
  const auto along = [&](double c) {
    return -0.25 * beta * beta * wavenumber * std::cos(wavenumber * c) * std::sin(wavenumber * c);
  };
  return {along(x[0]), along(x[1])};
}

std::vector<FieldsByHand> fields_by_hand() {
  const Points centres = (Points(2, 2) << 0.2, -0.4, 0.1, 0.5).finished();
  return {{"none", [](const auto&, const auto&, const auto&) -> Vector2d { return Vector2d::Zero(); },
           [](const auto&, const auto&) -> Vector2d { return Vector2d::Zero(); }},
          {"p-sd:beta=0.4", [](const auto&, const auto&, const auto& w) -> Vector2d { return 0.4 * w; },
           [](const auto&, const auto&) -> Vector2d { return Vector2d::Zero(); }},
          {"p-sd:beta=0.4,fields=cos,wavenumber=2",
           [](const auto& x, const auto&, const auto& w) { return cosines(x, 0.4, 2, w); },
           [](const auto& x, const auto&) { return cosine_compensation(x, 0.4, 2); }},
          {"p-sd:beta=0.4,fields=bump,center=0.2/0.1/-0.4/0.5,width=0.7",
           [centres](const auto& x, const auto&, const auto& w) { return bumps(x, centres, 0.4, 0.7, w); },
           [centres](const auto& x, const auto&) { return bump_compensation(x, centres, 0.4, 0.7); }},
          {"kunita:beta=0.4,width=0.8",
           [](const auto& x, const auto& q, const auto& w) { return bumps(x, q, 0.4, 0.8, w); },
           [](const auto& x, const auto& q) { return kunita_compensation(x, q, 0.4, 0.8); }},
          {"p-sd:beta=0.3,fields=cos,wavenumber=2+kunita:beta=0.4,width=0.8",
           [](const auto& x, const auto& q, const auto& w) -> Vector2d {
             return cosines(x, 0.3, 2, w.head(4)) + bumps(x, q, 0.4, 0.8, w.tail(14));
           },
           [](const auto& x, const auto& q) -> Vector2d {
             return cosine_compensation(x, 0.3, 2) + kunita_compensation(x, q, 0.4, 0.8);
           }}};
}

constexpr int kPieces = 4;  // of constant rates of the noise
constexpr double kAlpha = 0.7;

Motion piecewise_motion(const std::string& integrator, const std::string& noise, int steps_per_piece) {
  Landmarks shape;
  shape.points = spread_landmarks(2);
  const StochasticSystem system{make_kernel("gaussian:alpha=0.7", Points()), make_noise(noise, shape)};
  const Points rates = 2 * random_points(system.noise->channels(2, 7), kPieces, 9);
  Eigen::MatrixXd increments(rates.rows(), kPieces * steps_per_piece);
  for (Eigen::Index k = 0; k < increments.cols(); ++k)
    increments.col(k) = rates.col(k / steps_per_piece) / (kPieces * steps_per_piece);
  return move(integrator, system, {shape.points, 0.3 * random_points(2, 7, 2)}, {1, kPieces * steps_per_piece},
              increments);
}

// RK4 along the landmarks' path in steps of two of its own, where its middle is known.
Points integrated(const Motion& motion, const FieldsByHand& fields, bool compensated, const Points& labels) {
  const TimeGrid& grid = motion.path.grid;
  const double h = 2 * grid.dt();
  const auto velocity = [&](const PhaseState& at, const Eigen::VectorXd& rates, const Vector2d& x) {
    Vector2d u = fields.noise(x, at.q, rates);
    if (compensated) u += fields.compensation(x, at.q);
    for (int b = 0; b < at.q.cols(); ++b)
      u += std::exp(-(x - at.q.col(b)).squaredNorm() / (kAlpha * kAlpha)) * at.p.col(b);
    return u;
  };
  Points places = labels;
  for (int k = 0; k < grid.steps; k += 2) {
    const auto i = static_cast<std::size_t>(k);
    const PhaseState &first = motion.path.states[i], &middle = motion.path.states[i + 1],
                     &last = motion.path.states[i + 2];
    const Eigen::VectorXd rates = motion.path.increments.col(k) / grid.dt();
    for (auto column : places.colwise()) {
      const Vector2d x = column;
      const Vector2d a = velocity(first, rates, x), b = velocity(middle, rates, x + h / 2 * a),
                     c = velocity(middle, rates, x + h / 2 * b), d = velocity(last, rates, x + h * c);
      column = x + h / 6 * (a + 2 * b + 2 * c + d);
    }
  }
  return places;
}

struct Scheme {
  std::string name;
  bool compensated;  // moves landmarks and space by G, too
  int order;
};

TEST(DeclaredFields, FlowAsAnIntegrationByPlainLoopsDoes) {
  const Points labels = 1.5 * random_points(2, 20, 3);
  for (const FieldsByHand& fields : fields_by_hand())
    for (const Scheme& scheme :
         {Scheme{"variational", true, 1}, Scheme{"variational-paper", false, 1}, Scheme{"variational-2", false, 2},
          Scheme{"midpoint", false, 2}, Scheme{"heun", false, 2}}) {
      SCOPED_TRACE(fields.spec + " by " + scheme.name);
      std::vector<double> errors;
      for (const int steps : {20, 40}) {
        const Motion motion = piecewise_motion(scheme.name, fields.spec, steps);
        const Points end = motion.flow().end(labels);
        EXPECT_GT((end - labels).norm(), 1);
        errors.push_back((end - integrated(motion, fields, scheme.compensated, labels)).norm());
      }
      const double ratio = std::pow(2, scheme.order);
      EXPECT_NEAR(errors[0] / errors[1], ratio, 0.15 * ratio);
      EXPECT_LT(errors[1], scheme.order == 1 ? 0.05 : 1e-3);
    }
}

// ---- what is declared wrongly

struct UnknownField : NoiseFormula {
  std::vector<std::string> parameter_names() const { return {"beta"}; }
  std::string spec(const Eigen::VectorXd& /*theta*/) const { return "unknown-field"; }
  int channels(int dimension, int /*count*/) const { return dimension; }
  NoiseTraits traits() const { return {.displacement = Displacement::field(), .linear = true}; }
  template <class T>
  void add_potentials(const StateOf<T>& state, const VectorOf<T>& theta, VectorOf<T>& h) const {
    h += theta[0] * state.p.rowwise().sum();
  }
  template <class T>
  void add_gradient(const StateOf<T>& /*state*/, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    gradient.p.colwise() += theta[0] * w.cast<T>();
  }
};

TEST(DeclaredFields, MustBeGiven) {
  const StochasticSystem system{make_kernel("gaussian:alpha=0.7", Points()),
                                make_differentiated(UnknownField(), {1.0})};
  const Points q = spread_landmarks(2);
  const Motion motion = move("midpoint", system, {q, Points::Zero(2, 7)}, {1, 4}, random_points(2, 4, 9));
  EXPECT_THROW(motion.flow(), std::logic_error);
}

}  // namespace
}  // namespace pulson::warp
