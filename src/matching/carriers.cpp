#include "carriers.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>

#include "cometric.hpp"
#include "matching/momentum_basis.hpp"
#include "pulson/matching/data_term.hpp"
#include "representatives.hpp"

namespace pulson::matching {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

// So many at least: fields at later times are those of carriers, too, and the ends are interpolated between them.
constexpr Index kLeastCarriers = 150;
// Coordinates, beyond which the matrices of a search over paths cost too much: no more carriers than these have, and
// fewer landmarks all carry themselves where most would have to.
constexpr Index kMostCoordinates = 3000;

// c + ½|U(q − m)ᵀ|², the same U for each axis, the root of a form.
class QuadraticTerm final : public DataTerm {
 public:
  QuadraticTerm(const QuadraticForm& form, Points centre, double least)
      : form_(form), centre_(std::move(centre)), least_(least) {}

  double value(const Points& q) const override { return least_ + 0.5 * whitened(q - centre_).squaredNorm(); }

  Points gradient(const Points& q) const override { return whitened(q - centre_).transpose() * form_.root; }

  Linearisation linearise(const Points& q, const MatrixXd& changes) const override {
    const Index d = q.rows(), m = q.cols();
    Linearisation at{residual(q), MatrixXd::Zero(q.size() + 1, changes.cols())};
    for (Index axis = 0; axis < d; ++axis)
      at.changes.middleRows(axis * m, m) = form_.root * MatrixXd(changes(Eigen::seqN(axis, m, d), Eigen::all));
    return at;
  }

  bool is_least_squares() const override { return true; }

  VectorXd residual(const Points& q) const override {
    VectorXd r(q.size() + 1);
    r << whitened(q - centre_).reshaped(), std::sqrt(2 * least_);
    return r;
  }

  const QuadraticForm* form_of_each_axis() const override { return &form_; }

 private:
  MatrixXd whitened(const Points& change) const { return form_.root * change.transpose(); }

  const QuadraticForm& form_;
  Points centre_;
  double least_;
};

// The precision of the coordinates of each landmark; empty where it differs between them.
VectorXd precisions(const LandmarkTerm& observed, const Points& q) {
  VectorXd all(q.cols());
  for (Index a = 0; a < q.cols(); ++a) {
    const MatrixXd precision = observed.precision(a);
    all[a] = precision(0, 0);
    if (precision != all[a] * MatrixXd::Identity(q.rows(), q.rows())) return {};
  }
  return all;
}

}  // namespace

Carriers::Carriers(const MatchingProblem& problem, std::vector<Index> places)
    : problem_(problem),
      places_(std::move(places)),
      precision_(precisions(*problem.data->landmarks(), problem.source)) {
  const KernelOperator& kernel = problem.system.kernel;
  const Points at = problem.source(Eigen::all, places_);
  MatrixXd gram = kernel.gram(at, at);
  gram.diagonal().array() += regularisation(kernel);
  weights_ = gram.llt().solve(kernel.gram(at, problem.source)).transpose();
  const MatrixXd precise = precision_.cwiseSqrt().asDiagonal() * weights_;
  MatrixXd square = MatrixXd::Zero(std::ssize(places_), std::ssize(places_));
  square.selfadjointView<Eigen::Lower>().rankUpdate(precise.transpose());
  const Eigen::LLT<MatrixXd> factors(square);
  form_ = {factors.matrixU(), factors.solve(MatrixXd::Identity(square.rows(), square.rows()))};
}

MatchingProblem Carriers::problem(const Points& ends, const Points& all) const {
  const Points gradient = problem_.data->gradient(all) * weights_;
  const auto root = form_.root.triangularView<Eigen::Upper>();
  const MatrixXd residual = form_.root.transpose().triangularView<Eigen::Lower>().solve(MatrixXd(gradient.transpose()));
  const MatrixXd centre = ends.transpose() - root.solve(residual);
  const double least = problem_.data->value(all) - 0.5 * residual.squaredNorm();
  MatchingProblem few = problem_;
  few.source = problem_.source(Eigen::all, places_);
  few.data = std::make_shared<QuadraticTerm>(form_, centre.transpose(), std::max(0.0, least));
  return few;
}

Points Carriers::momenta(const Points& of_carriers) const {
  Points all = Points::Zero(problem_.source.rows(), problem_.source.cols());
  all(Eigen::all, places_) = of_carriers;
  return all;
}

std::optional<Carriers> find_carriers(const MatchingProblem& problem) {
  const LandmarkTerm* observed = problem.data->landmarks();
  const Index n = problem.source.cols();
  if (observed == nullptr || n <= 2 * kLeastCarriers || precisions(*observed, problem.source).size() == 0)
    return std::nullopt;
  const MatchingObjective whole(problem);
  std::vector<Index> places = representatives(problem, kLeastCarriers);
  for (const Index pivot : whole.basis().pivots())
    if (!observed->precision(pivot).isZero(0)) places.push_back(pivot);
  std::sort(places.begin(), places.end());
  places.erase(std::unique(places.begin(), places.end()), places.end());
  const Index most = kMostCoordinates / problem.source.rows();
  if (4 * std::ssize(places) > 3 * n && n <= 2 * most) return std::nullopt;
  if (std::ssize(places) > most) places = representatives(problem, most);
  return Carriers(problem, std::move(places));
}

}  // namespace pulson::matching
