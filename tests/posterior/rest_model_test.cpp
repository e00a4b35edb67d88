// The models linear about rest, which are found once for all kernels, against those that are shot at each.

#include "posterior/rest_model.hpp"

#include <string>
#include <tuple>

#include <gtest/gtest.h>

#include "pulson/noise/noise_table.hpp"
#include "random_numbers.hpp"

namespace pulson::posterior {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using Random = pulson::Numbers;

class Rest : public testing::TestWithParam<std::tuple<std::string, std::string>> {
 protected:
  static constexpr int kCount = 6;
  std::string integrator = std::get<0>(GetParam());
  std::string noise = std::get<1>(GetParam());
  Points source = Random(3).landmarks(2, kCount);

  // The last amplitude of the noise is that.
  std::shared_ptr<const NoiseModel> make(const std::string& amplitude) const {
    Landmarks shape;
    shape.points = source;
    return make_noise(noise == "none" ? noise : noise + amplitude, shape);
  }

  Specimen specimen() const {
    Random random(4);
    return Specimen({{make_kernel("gaussian:alpha=0.7", source), make("0.2")},
                     make_integrator(integrator),
                     {1, 5},
                     source,
                     std::make_shared<matching::LandmarkTerm>(
                         matching::LandmarkObservations{source + 0.2 * random(2, kCount), 0.1, {}, {}}),
                     0.1,
                     5,
                     {}},
                    AlignmentKind::kSimilarity);
  }

  Specimen::Model model(const Specimen& of, const std::string& kernel, const std::string& amplitude, double lambda,
                        double sigma) const {
    return of.model({std::make_shared<KernelOperator>(make_kernel(kernel, source)), make(amplitude), lambda, sigma});
  }

  void expect_those_of_shots(const RestModel& rest, const Specimen::Model& there) const {
    const auto found = rest.at(there);
    const auto expected = linear_at_rest(rest.specimen(), there);
    const MatrixXd covariance = expected->covariance(there);
    EXPECT_LT((found->covariance(there) - covariance).norm(), 1e-10 * covariance.norm());
    EXPECT_LT((found->offset() - expected->offset()).norm(), 1e-10 * expected->offset().norm());
    const LinearAt at(*found, there), of_shots(*expected, there);
    EXPECT_NEAR(at.log_evidence(), of_shots.log_evidence(), 1e-8);
    EXPECT_LT((at.mean() - of_shots.mean()).norm(), 1e-8 * of_shots.mean().norm());
  }
};

TEST_P(Rest, IsLinearAsShotsAre) {
  const Specimen of = specimen();
  const RestModel rest(of, model(of, "gaussian:alpha=0.7", "0.2", 5, 1));
  // The compensated `variational` moves landmarks at rest where the noise depends on their places.
  const bool moves =
      noise.find("trouve-vialard") != std::string::npos ||
      (integrator == "variational" && (noise.starts_with("p-sd") || noise.starts_with("ch-sd-screened")));
  EXPECT_EQ(rest.is_of_any_kernel(), !moves);
  expect_those_of_shots(rest, model(of, "gaussian:alpha=0.7", "0.2", 5, 1));
  expect_those_of_shots(rest, model(of, "gaussian:alpha=0.3", "0.05", 2, 1.5));
  expect_those_of_shots(rest, model(of, "matern32:alpha=2", "0.7", 11, 0.4));
}

INSTANTIATE_TEST_SUITE_P(Of, Rest,
                         testing::Combine(testing::Values("heun", "variational-2", "variational"),
                                          testing::Values("none", "ch-sd:beta=", "ch-sd-screened:gamma=0.5,beta=",
                                                          "p-sd:fields=grid,count=2,beta=", "trouve-vialard:sigma=",
                                                          "ch-sd:beta=0.1+trouve-vialard:sigma=")));

TEST(RestModel, KnowsOtherLengthsOfNoise) {
  const Points source = Random(3).landmarks(2, 5);
  Landmarks shape;
  shape.points = source;
  const auto noise = [&](const std::string& width) {
    return make_noise("p-sd:fields=grid,count=2,beta=0.2,width=" + width, shape);
  };
  const auto kernel = std::make_shared<KernelOperator>(make_kernel("gaussian:alpha=0.7", source));
  const Specimen of({{*kernel, noise("0.5")},
                     make_integrator("heun"),
                     {1, 4},
                     source,
                     std::make_shared<matching::LandmarkTerm>(matching::LandmarkObservations{source, 0.1, {}, {}}),
                     0.1,
                     5,
                     {}});
  const RestModel rest(of, of.model({kernel, noise("0.5"), 5, 1}));
  const Specimen::Model wider = of.model({kernel, noise("1.5"), 5, 1});
  const MatrixXd expected = linear_at_rest(of, wider)->covariance(wider);
  EXPECT_LT((rest.at(wider)->covariance(wider) - expected).norm(), 1e-12 * expected.norm());
}

}  // namespace
}  // namespace pulson::posterior
