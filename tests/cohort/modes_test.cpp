// Principal components, against their definition and against R.

#include <cstdlib>
#include <filesystem>

#include <gtest/gtest.h>

#include "atlas_examples.hpp"
#include "error_of.hpp"
#include "pulson/cohort/statistics.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

MatrixXd flattened_metric(const Atlas& atlas) {
  const MatrixXd gram = atlas.metric();
  const Index d = atlas.mean.points.rows(), n = gram.cols();
  MatrixXd all = MatrixXd::Zero(d * n, d * n);
  for (Index a = 0; a < n; ++a)
    for (Index b = 0; b < n; ++b) all.block(a * d, b * d, d, d).diagonal().setConstant(gram(a, b));
  return all;
}

MatrixXd covariance(const Atlas& atlas) {
  const auto n = static_cast<Index>(atlas.specimens.size());
  MatrixXd columns(atlas.mean.points.size(), n);
  for (Index i = 0; i < n; ++i) columns.col(i) = atlas.specimens[static_cast<std::size_t>(i)].momenta.reshaped();
  columns.colwise() -= columns.rowwise().mean().eval();
  return columns * columns.transpose() / static_cast<double>(n - 1);
}

// Few specimens are taken by specimens, many by coordinates.
class Modes : public testing::TestWithParam<int> {};

TEST_P(Modes, SolveTheGeneralisedEigenproblem) {
  const CohortLaw law;
  const Atlas atlas = make_atlas(drawn_shapes(law, GetParam(), 11), options_of(law));
  const ShapeModes modes = momentum_modes(atlas);
  const MatrixXd metric = flattened_metric(atlas), c = covariance(atlas);
  const double largest = modes.eigenvalues[0];
  ASSERT_EQ(modes.eigenvalues.size(), std::min(GetParam() - 1, 24));
  EXPECT_NEAR(modes.total(), (c * metric).trace(), 1e-10 * modes.total());
  MatrixXd all(24, modes.eigenvalues.size());
  for (Index k = 0; k < all.cols(); ++k) {
    all.col(k) = modes.directions[static_cast<std::size_t>(k)].reshaped();
    // C A π = μ π
    EXPECT_LT((metric * (c * (metric * all.col(k)) - modes.eigenvalues[k] * all.col(k))).norm(), 1e-9 * largest);
    EXPECT_NEAR(modes.scores.col(k).mean(), 0, 1e-9 * std::sqrt(largest));
    EXPECT_NEAR(modes.scores.col(k).squaredNorm() / (GetParam() - 1), modes.eigenvalues[k], 1e-9 * largest);
  }
  EXPECT_LT((all.transpose() * metric * all - MatrixXd::Identity(all.cols(), all.cols())).cwiseAbs().maxCoeff(), 1e-6);
  // Momenta are their mean and the sum of scores times directions.
  Points mean = 0 * atlas.mean.points;
  for (const AtlasSpecimen& specimen : atlas.specimens) mean += specimen.momenta / GetParam();
  const Eigen::VectorXd sum = mean.reshaped() + all * modes.scores.row(2).transpose();
  EXPECT_LT((sum - atlas.specimens[2].momenta.reshaped()).norm(), 1e-7 * sum.norm());
}

INSTANTIATE_TEST_SUITE_P(FewAndMany, Modes, testing::Values(7, 60));

// Of shapes by a formula, so that R has the same: eigenvalues and the sizes of the first scores.
struct RTable {
  int dimension;
  std::vector<double> eigenvalues, scores;
};

std::vector<Points> shapes_by_formula(int dimension) {
  std::vector<Points> shapes;
  for (int i = 0; i < 12; ++i) {
    Points points(dimension, 6);
    for (int a = 0; a < 6; ++a)
      for (int axis = 0; axis < dimension; ++axis)
        points(axis, a) = std::cos(1.3 * a + axis) + 0.1 * std::sin(7.1 * i + 2.3 * a + 1.7 * axis) +
                          0.05 * std::cos(3.7 * i * i + a * axis);
    shapes.push_back(points);
  }
  return shapes;
}

void expect_table(const std::vector<Points>& shapes, const std::vector<double>& eigenvalues,
                  const std::vector<double>& scores) {
  const ProcrustesModes found = procrustes_modes(shapes);
  for (std::size_t k = 0; k < eigenvalues.size(); ++k)
    EXPECT_NEAR(found.modes.eigenvalues[static_cast<Index>(k)], eigenvalues[k], 1e-10 * eigenvalues[0]) << k;
  for (std::size_t i = 0; i < scores.size(); ++i)
    EXPECT_NEAR(std::abs(found.modes.scores(static_cast<Index>(i), 0)), scores[i], 1e-10) << i;
  EXPECT_NEAR(found.mean.norm(), 1, 1e-14);
}

TEST(ProcrustesModes, AreOfTheLandmarksThatAllShapesHave) {
  std::vector<Points> shapes = shapes_by_formula(2), part;
  for (const Points& shape : shapes) part.emplace_back(shape(Eigen::all, std::vector<int>{0, 1, 3, 5}));
  shapes[0].col(2).setConstant(std::nan(""));
  shapes[7](1, 4) = std::nan("");
  const ProcrustesModes found = procrustes_modes(shapes), expected = procrustes_modes(part);
  EXPECT_EQ(found.landmarks, (std::vector<int>{0, 1, 3, 5}));
  EXPECT_EQ(found.modes.scores, expected.modes.scores);
  shapes[3].leftCols(2).setConstant(std::nan(""));
  EXPECT_EQ(error_of([&] { procrustes_modes(shapes); }),
            "only 2 landmarks are in all specimens, too few for Procrustes coordinates: leave specimens out that lack "
            "others");
}

// Expected numbers by R 4.2.2: rotations by procGPA(scale = FALSE) of package shapes 1.2.7 of shapes of unit size,
// repeated until they rest (by less than 2e-10), geomorph's projection `orp`, then prcomp.
TEST(ProcrustesModes, AreThoseOfR) {
  expect_table(
      shapes_by_formula(2),
      {6.1717218826596093e-03, 4.4183233793432964e-03, 3.8311606544809938e-04, 1.2669784718663603e-04,
       2.6206998467406356e-08, 1.1047986754589273e-08, 4.7957754576355801e-09, 3.4697344451180035e-09},
      {0.104642772656530977, 0.039604821464486135, 0.042787234241146450, 0.095484830494061729, 0.097845456006918630});
  expect_table(
      shapes_by_formula(3),
      {5.3574000728270985e-03, 4.9526612791767292e-03, 4.7995136312991091e-04, 2.1333563824088778e-04,
       4.8065756807693678e-07, 4.4034834127916746e-07, 1.0334567510704831e-07, 1.7731343885366931e-08},
      {0.072750833932325218, 0.023259219577071024, 0.070809244154468334, 0.070803584463880423, 0.026104845676215370});
}

std::vector<Points> real_shapes(const std::string& name) {
  const char* folder = std::getenv("PULSON_DATA");
  const std::filesystem::path data =
      folder != nullptr ? folder : std::filesystem::path(PULSON_SOURCE_DIR) / ".." / "shared" / "data";
  std::vector<Points> shapes;
  if (std::filesystem::exists(data / name))
    for (const Landmarks& shape : formats::read_landmark_file(data / name).shapes) shapes.push_back(shape.points);
  return shapes;
}

TEST(ProcrustesModes, OfRealShapesAreThoseOfR) {
  const std::vector<Points> gorillas = real_shapes("shapes_R/gorf.dat.csv");
  if (gorillas.empty()) GTEST_SKIP() << "there are no real shapes; set PULSON_DATA";
  expect_table(gorillas,
               {6.8857237317644139e-04, 4.5333627925653693e-04, 2.2265200931069479e-04, 1.7482703528700811e-04,
                1.1986077460771974e-04, 7.4169795053004539e-05, 6.9840827610882802e-05, 5.8217129244411412e-05},
               {0.0131142816371216560, 0.0225107025433747623, 0.0068407560690034019, 0.0202727348907842039,
                0.0213926077559400823});
  expect_table(real_shapes("shapes_R/schizophrenia.dat.csv"),
               {0.00112804261042566694, 0.00102430451897924258, 0.00078064929300120664, 0.00058704186734229050,
                0.00051395502268172886, 0.00032344647592395885, 0.00027651772856200076, 0.00019324456118121309},
               {0.0141316084353944015, 0.0057646269129263943, 0.0451880700311079186, 0.0512506784007791122,
                0.0339247137213467276});
}

}  // namespace
}  // namespace pulson::cohort
