#include "repeats.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <random>

#include "pulson/core/alignment.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::audit {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kPoseRounds = 10;  // of rigid Procrustes means, which converge at once where errors are small

Points mean_of(const std::vector<Points>& shapes) {
  Points sum = Points::Zero(shapes.front().rows(), shapes.front().cols());
  for (const Points& shape : shapes) sum += shape;
  return sum / static_cast<double>(shapes.size());
}

// Shapes of one specimen in one pose, about their mean.
std::vector<Points> in_one_pose(std::vector<Points> shapes) {
  Points mean = shapes.front();
  for (int round = 0; round < kPoseRounds; ++round) {
    for (Points& shape : shapes) shape = align(shape, mean, AlignmentKind::kRigid).apply(shape);
    mean = mean_of(shapes);
  }
  return shapes;
}

// Errors of one specimen's sessions, in the pose of the cohort's mean.
struct Errors {
  std::vector<Points> of_session;
};

std::vector<Errors> errors_of(const std::vector<Landmarks>& shapes, const std::vector<std::string>& specimens) {
  std::map<std::string, std::vector<Points>> sessions;
  std::vector<std::string> order;
  for (std::size_t i = 0; i < shapes.size(); ++i) {
    if (!shapes[i].points.allFinite())
      throw InputError(shapes[i].source + ": repeats are compared landmark by landmark, and one is missing");
    auto& of_one = sessions[specimens[i]];
    if (of_one.size() == 1) order.push_back(specimens[i]);
    of_one.push_back(shapes[i].points);
  }
  if (order.empty())
    throw InputError(
        "no specimen has more than one shape; a column of a table can say of which specimen each shape is");
  const Points pose = sessions.at(order.front()).front();
  std::vector<Errors> all;
  for (const std::string& specimen : order) {
    const std::vector<Points> posed = in_one_pose(sessions.at(specimen));
    const Points mean = mean_of(posed);
    const MatrixXd rotation = align(mean, pose, AlignmentKind::kRigid).linear;
    Errors& errors = all.emplace_back();
    for (const Points& shape : posed) errors.of_session.emplace_back(rotation * (shape - mean));
  }
  return all;
}

double alignment_factor(const Points& shape) {
  const auto d = static_cast<double>(shape.rows()), all = static_cast<double>(shape.size());
  const double taken = d + d * (d - 1) / 2;
  if (all <= taken) throw InputError("repeats have too few landmarks to tell errors from poses");
  return all / (all - taken);
}

// Σ_k |m_k − m|² of each landmark, the sessions of each specimen in the given order.
VectorXd session_squares(const std::vector<const Errors*>& specimens, const std::vector<std::vector<int>>& order) {
  const std::size_t sessions = order.front().size();
  const Points& first = specimens.front()->of_session.front();
  VectorXd squares = VectorXd::Zero(first.cols());
  for (std::size_t k = 0; k < sessions; ++k) {
    Points sum = Points::Zero(first.rows(), first.cols());
    for (std::size_t i = 0; i < specimens.size(); ++i)
      sum += specimens[i]->of_session[static_cast<std::size_t>(order[i][k])];
    squares += (sum / static_cast<double>(specimens.size())).colwise().squaredNorm().transpose();
  }
  return squares / static_cast<double>(sessions);
}

std::optional<SessionBias> session_bias(const std::vector<Errors>& all, int permutations, std::uint64_t seed) {
  std::map<std::size_t, int> counts;
  for (const Errors& errors : all) ++counts[errors.of_session.size()];
  const auto usual =
      std::max_element(counts.begin(), counts.end(), [](const auto& a, const auto& b) { return a.second < b.second; });
  if (usual->second < 2) return std::nullopt;
  std::vector<const Errors*> specimens;
  for (const Errors& errors : all)
    if (errors.of_session.size() == usual->first) specimens.push_back(&errors);
  std::vector<int> given;
  for (std::size_t k = 0; k < usual->first; ++k) given.push_back(static_cast<int>(k));
  std::vector<std::vector<int>> order(specimens.size(), given);
  const VectorXd squares = session_squares(specimens, order);
  std::mt19937_64 random(seed);
  int as_large = 1;  // the order that was given
  for (int k = 0; k < permutations; ++k) {
    for (std::vector<int>& of_one : order) std::shuffle(of_one.begin(), of_one.end(), random);
    if (session_squares(specimens, order).sum() >= squares.sum() * (1 - 1e-12)) ++as_large;
  }
  return SessionBias{.sessions = static_cast<int>(usual->first),
                     .specimens = usual->second,
                     .distances = squares.cwiseSqrt(),
                     .distance = std::sqrt(squares.mean()),
                     .p = static_cast<double>(as_large) / (permutations + 1),
                     .permutations = permutations};
}

}  // namespace

Repeatability repeatability(const std::vector<Landmarks>& shapes, const std::vector<std::string>& specimens,
                            int permutations, std::uint64_t seed) {
  for (const Landmarks& shape : shapes) require_alike(shapes.front(), shape);
  const std::vector<Errors> all = errors_of(shapes, specimens);
  const Index d = shapes.front().points.rows(), n = shapes.front().points.cols();
  Repeatability result;
  result.specimens = static_cast<int>(all.size());
  result.covariances.assign(static_cast<std::size_t>(n), MatrixXd::Zero(d, d));
  for (const Errors& errors : all) {
    result.shapes += static_cast<int>(errors.of_session.size());
    for (const Points& error : errors.of_session)
      for (Index a = 0; a < n; ++a)
        result.covariances[static_cast<std::size_t>(a)] += error.col(a) * error.col(a).transpose();
  }
  const double degrees = result.shapes - result.specimens;
  const double factor = alignment_factor(shapes.front().points) / degrees;
  result.sigmas.resize(n);
  for (Index a = 0; a < n; ++a) {
    MatrixXd& covariance = result.covariances[static_cast<std::size_t>(a)];
    covariance *= factor;
    result.sigmas[a] = std::sqrt(covariance.trace() / static_cast<double>(d));
  }
  result.sigma = std::sqrt(result.sigmas.squaredNorm() / static_cast<double>(n));
  result.bias = session_bias(all, permutations, seed);
  return result;
}

}  // namespace pulson::audit
