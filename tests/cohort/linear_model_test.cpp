#include "pulson/cohort/linear_model.hpp"

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include <Eigen/QR>
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "error_of.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "random/normals.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::string terms_of(const std::string& formula) { return ModelFormula::parse(formula).text(); }

// Terms as R 4.2.2's terms() has them.
TEST(ModelFormula, HasTheTermsOfR) {
  EXPECT_EQ(terms_of("size"), "size");
  EXPECT_EQ(terms_of("shape ~ log(size) + species * site"), "log(size) + species + site + species:site");
  EXPECT_EQ(terms_of("a*b*c"), "a + b + c + a:b + a:c + b:c + a:b:c");
  EXPECT_EQ(terms_of("a:b + a"), "a + a:b");
  EXPECT_EQ(terms_of("species / site"), "species + species:site");
  EXPECT_EQ(terms_of("(a + b) / c"), "a + b + a:b:c");
  EXPECT_EQ(terms_of("b %in% a + a"), "a + b:a");
  EXPECT_EQ(terms_of("(a + b + c)^2 - a:b"), "a + b + c + a:c + b:c");
  EXPECT_EQ(terms_of("a * b - a"), "b + a:b");
  EXPECT_EQ(terms_of("1 + I(size^2) + a"), "I(size^2) + a");
  EXPECT_EQ(terms_of("log( size/10 )+`body mass`"), "log(size/10) + body mass");
  EXPECT_EQ(terms_of("a + a + (a)"), "a");
  EXPECT_THAT(ModelFormula::parse("log(size / width) + factor(site) * size").columns(),
              ElementsAre("size", "width", "site"));
}

TEST(ModelFormula, NamesWhatIsWrong) {
  const auto error = [](const std::string& text) { return error_of([&] { ModelFormula::parse(text); }); };
  EXPECT_THAT(error("a +"), HasSubstr("something is missing at character 4"));
  EXPECT_THAT(error("a b"), HasSubstr("unexpected 'b' at character 3"));
  EXPECT_THAT(error("log(a"), HasSubstr("')' is missing"));
  EXPECT_THAT(error("`a"), HasSubstr("a backtick is missing"));
  EXPECT_THAT(error("weight ~ a"), HasSubstr("on its left are the shapes; leave out 'weight'"));
  EXPECT_THAT(error("a - 1"), HasSubstr("the model has an intercept"));
  EXPECT_THAT(error("0 + a"), HasSubstr("the model has an intercept"));
  EXPECT_THAT(error("size^0.5"), HasSubstr("I(size^0.5) is that of a number"));
  EXPECT_THAT(error("a - a"), HasSubstr("it has no term"));
  EXPECT_THAT(error("poly(a, 2)"), HasSubstr("takes one argument"));
  EXPECT_THAT(error(""), HasSubstr("something is missing"));
}

// Of 24 specimens: a factor of three levels that look like numbers, one of two, and a number.
ModelData example_data() {
  ModelData data;
  const VectorXd x = standard_normals(11, 0, 24, 1);
  for (int i = 0; i < 24; ++i) {
    data.specimens.push_back(fmt::format("s{}", i + 1));
    data.columns["site"].push_back(fmt::format("{}", std::vector{10, 2, 1}[static_cast<std::size_t>(i % 3)]));
    data.columns["sex"].emplace_back(i % 4 < 2 ? "m" : "f");
    data.columns["size"].push_back(fmt::format("{:.17g}", 5 + x[i] + i % 3));
  }
  return data;
}

MatrixXd example_rows(std::uint64_t seed = 12, int count = 24, int coordinates = 7) {
  return standard_normals(seed, 0, count * coordinates, 1).reshaped(count, coordinates);
}

// Of the residuals beside indicators of all levels and combinations.
double residual_squares(const MatrixXd& rows, const std::vector<VectorXd>& columns) {
  MatrixXd design(rows.rows(), std::ssize(columns));
  for (std::size_t c = 0; c < columns.size(); ++c) design.col(static_cast<Index>(c)) = columns[c];
  return (rows - design * design.completeOrthogonalDecomposition().solve(rows)).squaredNorm();
}

TEST(LinearModel, HasTheSumsOfSquaresOfNestedLeastSquares) {
  const ModelData data = example_data();
  const MatrixXd rows = example_rows();
  const ModelDesign design = make_design(ModelFormula::parse("size + factor(site) * sex + size:sex"), data);
  const ModelTest found = test_model(design, rows, {99, 1});
  const auto indicator = [&](const std::string& column, const std::string& level) {
    VectorXd values(24);
    for (Index i = 0; i < 24; ++i) values[i] = data.columns.at(column)[static_cast<std::size_t>(i)] == level ? 1 : 0;
    return values;
  };
  VectorXd size(24);
  for (Index i = 0; i < 24; ++i) size[i] = std::stod(data.columns.at("size")[static_cast<std::size_t>(i)]);
  std::vector<VectorXd> columns{VectorXd::Ones(24)};
  std::vector<double> left{residual_squares(rows, columns)};
  const auto add = [&](const std::vector<VectorXd>& more) {
    columns.insert(columns.end(), more.begin(), more.end());
    left.push_back(residual_squares(rows, columns));
  };
  std::vector<VectorXd> sites, sexes{indicator("sex", "f"), indicator("sex", "m")}, both, slopes;
  for (const char* level : {"1", "2", "10"}) sites.push_back(indicator("site", level));
  for (const VectorXd& a : sites)
    for (const VectorXd& b : sexes) both.push_back(a.cwiseProduct(b));
  for (const VectorXd& b : sexes) slopes.push_back(b.cwiseProduct(size));
  add({size});
  add(sites);
  add(sexes);
  add(both);
  add(slopes);
  const std::vector<int> df{1, 2, 1, 2, 1};
  ASSERT_EQ(found.terms.size(), 5U);
  EXPECT_EQ(design.residual_df(), 16);
  EXPECT_NEAR(found.total_ss, left.front(), 1e-10 * left.front());
  EXPECT_NEAR(found.residual_ss, left.back(), 1e-10 * left.front());
  for (std::size_t t = 0; t < 5; ++t) {
    EXPECT_EQ(design.terms[t].df, df[t]);
    EXPECT_NEAR(found.terms[t].ss, left[t] - left[t + 1], 1e-10 * left.front());
    EXPECT_NEAR(found.terms[t].f, (left[t] - left[t + 1]) / df[t] / (left.back() / 16), 1e-9);
  }
  EXPECT_THAT(design.names, ElementsAre("size", "factor(site)2", "factor(site)10", "sexm", "factor(site)2:sexm",
                                        "factor(site)10:sexm", "size:sexm"));
  const MatrixXd coefficients = design.weights * rows;
  MatrixXd all(24, 8);
  all << VectorXd::Ones(24), design.columns;
  const MatrixXd expected = all.colPivHouseholderQr().solve(rows);
  EXPECT_LT((coefficients - expected.bottomRows(7)).norm(), 1e-10 * expected.norm());
}

TEST(LinearModel, ComparesMeansOfGroupsAtTheMeanOfCovariates) {
  const ModelData data = example_data();
  const MatrixXd rows = example_rows(13);
  const ModelDesign design = make_design(ModelFormula::parse("size + sex"), data);
  const ModelTest found = test_model(design, rows, {499, 1});
  ASSERT_EQ(found.pairs.size(), 1U);
  // With equal slopes the difference of adjusted means is the coefficient of the factor.
  const MatrixXd coefficients = design.weights * rows;
  EXPECT_NEAR(found.pairs[0].distance, coefficients.row(1).norm(), 1e-10);
  EXPECT_EQ(design.terms[1].groups[0].name, "f");
  // Without other terms they are plain means.
  const ModelDesign alone = make_design(ModelFormula::parse("factor(site)"), data);
  const ModelTest of_sites = test_model(alone, rows, {99, 1});
  ASSERT_EQ(of_sites.pairs.size(), 3U);
  VectorXd first = VectorXd::Zero(7), last = VectorXd::Zero(7);
  for (Index i = 0; i < 24; i += 3) {
    last += rows.row(i).transpose() / 8;       // site 10
    first += rows.row(i + 2).transpose() / 8;  // site 1
  }
  EXPECT_NEAR(of_sites.pairs[1].distance, (last - first).norm(), 1e-12);
}

// Kolmogorov's bound for 400 draws at 1 in 1000 is 1.95/√400, and p takes steps of 1/100.
TEST(LinearModel, IsExactForATermThatIsNotThereBesideOneThatIs) {
  ModelData data = example_data();
  std::vector<double> p;
  for (std::uint64_t draw = 0; draw < 400; ++draw) {
    const VectorXd x = standard_normals(500 + draw, 0, 24, 1);
    MatrixXd rows = example_rows(1000 + draw);
    for (Index i = 0; i < 24; ++i) {
      const std::vector<std::string>& sex = data.columns["sex"];
      data.columns["size"][static_cast<std::size_t>(i)] =
          fmt::format("{:.17g}", x[i] + (sex[static_cast<std::size_t>(i)] == "m" ? 1 : 0));
      rows.row(i).array() += 2 * std::stod(data.columns["size"][static_cast<std::size_t>(i)]);
    }
    p.push_back(test_model(make_design(ModelFormula::parse("size + sex"), data), rows, {99, draw}).terms[1].p_value);
  }
  std::sort(p.begin(), p.end());
  double largest = 0;
  for (std::size_t i = 0; i < p.size(); ++i)
    largest = std::max(largest, std::abs(p[i] - (static_cast<double>(i) + 0.5) / static_cast<double>(p.size())));
  EXPECT_LT(largest, 1.95 / std::sqrt(400.0) + 0.01);
}

// Of 5001 values a normal deviate of 3 has the standard error √((1 + 3²/2)/5000) = 0.033; λ adds about as much.
TEST(EffectSize, IsADeviateAfterTheRightPower) {
  VectorXd normal = standard_normals(5, 0, 5001, 1);
  normal[0] = 3;
  EXPECT_NEAR(effect_size(normal.array().exp()), 3, 0.15);
  EXPECT_NEAR(effect_size((6 + normal.array()).square()), 3, 0.15);
  EXPECT_NEAR(effect_size((6 + normal.array()).inverse().square()), -3, 0.2);
  EXPECT_TRUE(std::isnan(effect_size(VectorXd::Ones(10))));
}

TEST(LinearModel, LeavesOutWhatMissesAValue) {
  ModelData data = example_data();
  data.columns["size"][3] = "NA";
  data.columns["sex"][7] = "";
  const ModelDesign design = make_design(ModelFormula::parse("log(size) + sex"), data);
  EXPECT_EQ(design.specimens.size(), 22U);
  EXPECT_THAT(design.notes,
              ElementsAre("log(size) + sex: 2 specimens are left out of the model, since a value is missing "
                          "in s4, s8"));
  EXPECT_THAT(make_design(ModelFormula::parse("site"), data).notes,
              ElementsAre("site is a number with 3 values; factor(site) would take them as groups"));
  EXPECT_THAT(make_design(ModelFormula::parse("factor(site)"), data).notes, IsEmpty());
}

TEST(LinearModel, RefusesWhatCannotBeEstimated) {
  ModelData data = example_data();
  data.columns["one"] = std::vector<std::string>(24, "a");
  data.columns["same"] = std::vector<std::string>(24, "7");
  data.columns["own"] = data.specimens;
  data.columns["twice"] = data.columns["size"];
  data.columns["zero"] = data.columns["size"];
  data.columns["zero"][5] = "0";
  data.columns["words"] = data.columns["size"];
  data.columns["words"][5] = "big";
  const auto error = [&](const std::string& text) {
    return error_of([&] { make_design(ModelFormula::parse(text), data); });
  };
  EXPECT_THAT(error("one"), HasSubstr("one is one group, 'a'; a comparison needs two groups"));
  EXPECT_THAT(error("same"), HasSubstr("same has the same value for all specimens"));
  EXPECT_THAT(error("own"), HasSubstr("each specimen is a group of its own"));
  EXPECT_THAT(error("size + twice"), HasSubstr("twice is a combination of the terms before it"));
  EXPECT_THAT(error("log(zero)"), HasSubstr("log(zero) is not a finite number for specimen 's6'"));
  EXPECT_THAT(error("log(words)"), HasSubstr("log(words): 'big' of words for specimen 's6' is not a number"));
  EXPECT_THAT(error("sin(size)"), HasSubstr("there is no function 'sin'; there are log"));
  EXPECT_THAT(error("height"), HasSubstr("'height', of which there is no column"));
  EXPECT_THAT(error("factor(site) * sex * factor(twice)"), HasSubstr("each specimen is a group of its own"));
  data.columns["size"] = std::vector<std::string>(24, "NA");
  EXPECT_THAT(error("size"), HasSubstr("0 specimens have all of size; a model needs three"));
}

// procD.lm of R's geomorph 4.0.8 (iter = 9999) after gpagen(): SS, R², F, Z, p of each term.
struct Reference {
  std::string shapes, formula;
  struct Row {
    double ss, r_squared, f, z, p;
  };
  std::vector<Row> rows;
  double residual, total;
  std::string groups{};  // a table
};

const std::vector<Reference>& references() {
  static const std::string gorillas = "shapes_R/gorf.dat.csv", plethodon = "geomorph_R/plethodon.csv",
                           schizophrenia = "shapes_R/schizophrenia.dat.csv", mice = "shapes_R/mice_landmarks.csv",
                           of_plethodon = "geomorph_R/plethodon_groups.csv";
  static const std::vector<Reference> all = {
      {gorillas, "log(size)", {{0.002214677, 0.038632149, 1.1251678, 0.46176, 0.3235}}, 0.055112629, 0.057327306},
      {plethodon, "log(size)", {{0.0088940418, 0.045161236, 1.797295, 1.2264, 0.115}}, 0.18804569, 0.19693973},
      {"geomorph_R/hummingbirds.csv",
       "log(size)",
       {{0.012697424, 0.076177229, 3.4632656, 1.9093, 0.0249}},
       0.15398525,
       0.16668267},
      {schizophrenia, "log(size)", {{0.0074168932, 0.049504571, 1.3541557, 0.89931, 0.1878}}, 0.1424055, 0.14982239},
      {mice, "log(size)", {{0.088608514, 0.22885658, 21.961398, 5.8858, 1e-4}}, 0.29857071, 0.38717922},
      {"ktch_mosquito_csv/data_landmark_mosquito_wings.csv",
       "log(size)",
       {{0.0047642775, 0.0087335367, 1.1013104, 0.41381, 0.3378}},
       0.54075098,
       0.54551525},
      {plethodon, "species", {{0.029257833, 0.14856237, 6.6303975, 3.2351, 2e-4}}, 0.1676819, 0.19693973, of_plethodon},
      {plethodon, "site", {{0.064374842, 0.32687585, 18.453182, 4.9849, 1e-4}}, 0.13256489, 0.19693973, of_plethodon},
      {plethodon,
       "species*site",
       {{0.029257833, 0.14856237, 14.543667, 4.4082, 1e-4},
        {0.064374842, 0.32687585, 31.999851, 5.5641, 1e-4},
        {0.030885023, 0.15682474, 15.352521, 4.9401, 1e-4}},
       0.072422035,
       0.19693973,
       of_plethodon},
      {plethodon,
       "log(size)+species*site",
       {{0.0088940418, 0.045161236, 4.5330535, 2.7025, 0.0023},
        {0.026878745, 0.13648209, 13.699372, 4.2829, 1e-4},
        {0.062676929, 0.31825436, 31.944742, 5.5283, 1e-4},
        {0.029818543, 0.15140948, 15.197708, 4.744, 1e-4}},
       0.068671474,
       0.19693973,
       of_plethodon},
      {mice,
       "group",
       {{0.098078941, 0.25331664, 12.382836, 6.6544, 1e-4}},
       0.28910028,
       0.38717922,
       "shapes_R/mice_groups.csv"},
      {schizophrenia,
       "group",
       {{0.010167772, 0.067865505, 1.8929705, 1.7478, 0.0401}},
       0.13965462,
       0.14982239,
       "shapes_R/schizophrenia_groups.csv"}};
  return all;
}

std::filesystem::path data_folder() {
  const char* const folder = std::getenv("PULSON_DATA");
  return folder != nullptr ? folder : std::filesystem::path(PULSON_SOURCE_DIR) / ".." / "shared" / "data";
}

void read_columns(const std::filesystem::path& table, ModelData& data) {
  std::ifstream stream(table);
  std::vector<std::string> header;
  for (std::string line; std::getline(stream, line);) {
    std::istringstream fields(line);
    std::vector<std::string> row;
    for (std::string field; std::getline(fields, field, ',');) row.push_back(field);
    if (header.empty())
      header = row;
    else
      for (std::size_t c = 0; c < header.size(); ++c) data.columns[header[c]].push_back(row[c]);
  }
}

// geomorph's superimposition ends where it changes by less than about 1e-4, so that its sums of squares have six
// digits. Both Z and p have Monte Carlo errors: three of the difference.
void expect_reference(const Reference& reference) {
  SCOPED_TRACE(reference.shapes + ": " + reference.formula);
  constexpr double kDigits = 1e-6;
  constexpr int kPermutations = 9999;
  ModelData data;
  std::vector<Points> shapes;
  for (const Landmarks& shape : formats::read_landmark_file(data_folder() / reference.shapes).shapes) {
    shapes.push_back(shape.points);
    data.specimens.push_back(shape.name);
    data.columns["size"].push_back(
        fmt::format("{:.17g}", (shape.points.colwise() - shape.points.rowwise().mean()).norm()));
  }
  if (!reference.groups.empty()) read_columns(data_folder() / reference.groups, data);
  const ModelDesign design = make_design(ModelFormula::parse(reference.formula), data);
  const ModelTest found = test_model(design, procrustes_modes(shapes).modes.scores, {kPermutations, 1});
  ASSERT_EQ(found.terms.size(), reference.rows.size());
  EXPECT_NEAR(found.residual_ss, reference.residual, kDigits * reference.total);
  EXPECT_NEAR(found.total_ss, reference.total, kDigits * reference.total);
  for (std::size_t t = 0; t < found.terms.size(); ++t) {
    const Reference::Row& row = reference.rows[t];
    const TermTest& term = found.terms[t];
    SCOPED_TRACE(design.terms[t].label);
    EXPECT_NEAR(term.ss, row.ss, kDigits * reference.total);
    EXPECT_NEAR(term.r_squared, row.r_squared, kDigits);
    EXPECT_NEAR(term.f, row.f, kDigits * row.f);
    EXPECT_NEAR(term.z, row.z, 3 * std::sqrt(2) * term.z_error);
    EXPECT_NEAR(term.p_value, row.p, 3 * std::sqrt(2 * row.p * (1 - row.p) / kPermutations));
  }
}

TEST(LinearModel, OfProcrustesCoordinatesIsThatOfGeomorph) {
  int compared = 0;
  for (const Reference& reference : references())
    if (std::filesystem::exists(data_folder() / reference.shapes)) {
      expect_reference(reference);
      ++compared;
    }
  if (compared == 0) GTEST_SKIP() << "there are no real shapes; PULSON_DATA may name the folder with the data";
}

}  // namespace
}  // namespace pulson::cohort
