// The cometric of a configuration against dense matrices.

#include "cometric.hpp"

#include <string>

#include <Eigen/LU>
#include <gtest/gtest.h>

#include "path_examples.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kCount = 5;
constexpr double kLambda = 1.3;
const std::string kKernel = "gaussian:alpha=0.5+matern32:alpha=1.1,weight=0.3";

// I ⊗ K + λΣ h_i,p h_i,pᵀ + εK(0), index a·d + axis, the noise by differences of its potentials, which are linear.
MatrixXd dense_cometric(const StochasticSystem& system, const Points& q) {
  const Index d = q.rows(), n = q.cols();
  const MatrixXd gram = system.kernel.gram(q, q);
  MatrixXd a(d * n, d * n), fields(d * n, system.noise->potentials({q, q}).size());
  for (Index i = 0; i < d * n; ++i) {
    fields.row(i) = system.noise->potentials({q, VectorXd::Unit(d * n, i).reshaped(d, n)});
    for (Index j = 0; j < d * n; ++j) a(i, j) = i % d == j % d ? gram(i / d, j / d) : 0;
  }
  a += kLambda * fields * fields.transpose();
  a.diagonal().array() += regularisation(system.kernel);
  return a;
}

void expect_dense(const Cometric& cometric, const MatrixXd& a, Index d, Numbers& numbers) {
  const Index n = a.rows() / d;
  ASSERT_TRUE(cometric.is_regular());
  const Points p = numbers(d, n);
  const VectorXd right = a * p.reshaped();
  EXPECT_LE((cometric.apply(p).reshaped() - right).norm(), 1e-13 * right.norm());
  EXPECT_LE((a * cometric.solve(p).reshaped() - p.reshaped()).norm(), 1e-11 * p.norm());

  const MatrixXd psi = numbers(n, d * d);
  MatrixXd block_diagonal = MatrixXd::Zero(d * n, d * n);
  for (Index b = 0; b < n; ++b) block_diagonal.block(b * d, b * d, d, d) = psi.row(b).reshaped(d, d);
  const MatrixXd transformed = block_diagonal * a * block_diagonal.transpose();
  for (Index b = 0; b < n; ++b) {
    const MatrixXd before = numbers(b + 1, d * d);
    MatrixXd sum = before;
    cometric.add_transformed(psi, 0.3, b, sum);
    for (Index c = 0; c <= b; ++c) {
      const MatrixXd block = transformed.block(c * d, b * d, d, d);
      EXPECT_LE((sum.row(c) - before.row(c) - 0.3 * block.reshaped().transpose()).norm(), 1e-13) << c << ", " << b;
    }
  }
}

TEST(Cometric, IsThatOfEachNoise) {
  for (const std::string& noise : linear_noise_specs())
    for (const int d : {1, 2, 3}) {
      SCOPED_TRACE(noise + " in " + std::to_string(d) + "D");
      Numbers numbers(3);
      const Points q = numbers.landmarks(d, kCount);
      const StochasticSystem system = make_system(kKernel, noise, q);
      const NoiseCometric of_noise = noise_cometric(*system.noise, q);
      EXPECT_TRUE(of_noise.isotropic);
      expect_dense(Cometric(system.kernel, of_noise, kLambda, q), dense_cometric(system, q), d, numbers);
      const PhaseState state{q, numbers(d, kCount)};
      const Points velocity = EffectiveHamiltonian(system, kLambda).velocity(state);
      EXPECT_LE((Cometric(system.kernel, of_noise, kLambda, q).apply(state.p) - velocity).norm(),
                1e-9 * velocity.norm());
    }
}

// Noise whose fields turn and differ from axis to axis.
TEST(Cometric, MayCoupleAxes) {
  for (const int d : {1, 2, 3}) {
    SCOPED_TRACE(d);
    Numbers numbers(4);
    const Points q = numbers.landmarks(d, kCount);
    const StochasticSystem system = make_system(kKernel, "none", q);
    MatrixXd fields = numbers(d * kCount, 4);
    fields.middleRows(d, 2 * d).setZero();
    const MatrixXd noise = fields * fields.transpose();
    const NoiseCometric coupled{noise.sparseView(), false};
    expect_dense(Cometric(system.kernel, coupled, kLambda, q), dense_cometric(system, q) + kLambda * noise, d, numbers);
  }
}

// Where the fields of a model of one's own couple axes, or are of some axes only.
class FieldsOfAxes final : public NoiseModel {
 public:
  FieldsOfAxes(MatrixXd fields) : fields_(std::move(fields)) {}  // dN×C

  std::string spec() const override { return "fields-of-axes"; }
  int channels(int, int) const override { return static_cast<int>(fields_.cols()); }
  NoiseTraits traits() const override { return {.displacement = Displacement::landmarks(), .linear = true}; }
  void check(int, int) const override {}
  std::vector<std::string> parameter_names() const override { return {}; }
  VectorXd parameters() const override { return {}; }
  std::shared_ptr<const NoiseModel> with_parameters(const VectorXd&) const override { return nullptr; }
  void add_to(const NoiseSums<double>& sums) const override { add(sums); }
  void add_to(const NoiseSums<Dual>& sums) const override { add(sums); }
  void add_to(const SpaceSums<double>&) const override {}
  void add_to(const SpaceSums<Dual>&) const override {}

 private:
  template <class T>
  void add(const NoiseSums<T>& to) const {
    const MatrixOf<T> fields = fields_.template cast<T>();
    if (to.potentials) *to.potentials += fields.transpose().lazyProduct(to.at.p.reshaped());
    if (to.gradient) to.gradient->p.reshaped() += fields.lazyProduct(to.w.template cast<T>());
  }

  MatrixXd fields_;
};

TEST(Cometric, IsThatOfNoiseThatIsNotIsotropic) {
  Numbers numbers(5);
  const Points q = numbers.landmarks(2, kCount);
  MatrixXd turning = numbers(2 * kCount, 3);
  MatrixXd of_first_axis = MatrixXd::Zero(2 * kCount, 1), of_second_axis = of_first_axis;
  of_first_axis(Eigen::seqN(0, kCount, 2), 0).setConstant(0.7);
  of_second_axis(Eigen::seqN(1, kCount, 2), 0).setConstant(0.7);
  for (const MatrixXd& fields : {turning, of_first_axis, of_second_axis}) {
    const StochasticSystem system{make_kernel(kKernel), std::make_shared<FieldsOfAxes>(fields)};
    const NoiseCometric of_noise = noise_cometric(*system.noise, q);
    EXPECT_FALSE(of_noise.isotropic);
    expect_dense(Cometric(system.kernel, of_noise, kLambda, q), dense_cometric(system, q), 2, numbers);
  }
}

TEST(Cometric, IsRegularWhereLandmarksCoincide) {
  const Points q{{0, 0, 1}, {2, 2, 0}};
  for (const std::string noise : {"none", "ch-sd:beta=1e-3", "ch-sd:beta=0.5,on=3"}) {
    const StochasticSystem system = make_system(kKernel, noise, q);
    EXPECT_TRUE(Cometric(system.kernel, noise_cometric(*system.noise, q), 1, q).is_regular());
  }
}

// The fields of channels that each move a landmark are found together: potentials, one momentum at a time, give them
// one by one.
TEST(NoiseCometric, IsThatOfPotentialsWhereEachChannelMovesOneLandmark) {
  Numbers numbers(7);
  const Points q = numbers(2, kCount);
  for (const char* spec :
       {"ch-sd:beta=0.3,on=2/4", "ch-sd:beta=0.3+ch-sd:beta=0.7,on=1/5", "ch-sd-screened:beta=0.2,gamma=1"}) {
    Landmarks shape;
    shape.points = q;
    const std::shared_ptr<const NoiseModel> noise = make_noise(spec, shape);
    const bool is_declared = std::string(spec).rfind("ch-sd-screened", 0) != 0;
    EXPECT_EQ(landmarks_of_channels(*noise, q).empty(), !is_declared) << spec;
    const NoiseCometric found = noise_cometric(*noise, q);
    MatrixXd fields(2 * kCount, noise->channels(2, kCount));
    for (Index i = 0; i < 2 * kCount; ++i)
      fields.row(i) = noise->potentials({q, VectorXd::Unit(2 * kCount, i).reshaped(2, kCount)});
    MatrixXd dense = fields * fields.transpose();
    if (found.isotropic) dense = MatrixXd(dense(Eigen::seqN(0, kCount, 2), Eigen::seqN(0, kCount, 2)));
    EXPECT_LE((MatrixXd(found.matrix) - dense).norm(), 1e-14 * dense.norm()) << spec;
  }
}

}  // namespace
}  // namespace pulson::matching
