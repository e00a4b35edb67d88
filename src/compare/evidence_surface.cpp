#include "evidence_surface.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include <Eigen/Eigenvalues>

#include "pulson/core/errors.hpp"
#include "sampled.hpp"

namespace pulson::compare {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using Eigen::VectorXd;

constexpr int kFewestSampled = 3;  // shapes: fewer have deviations far larger than the bias of Laplace's numbers
// Of a shape the latter two. Of 26 cohorts of 40 shapes intervals of 90 % held 20 with 24 draws of each, and 24
// with 48.
constexpr int kDrawsOfCohort = 1920, kFewestDraws = 16, kMostDraws = 48;
constexpr double kMostDeviation = 2;  // of x: a number less determined than by a factor e² is searched as if it were
// Deviations of a number, and of x at most where the data do not determine it. What draws add to 20 ovals had a slope
// of 1.5 nats along sigma, which promised 15 nats in five times that.
constexpr double kTrusted = 1.5, kMostTrusted = 0.7;
constexpr double kFar = 0.5;            // deviations, within the steps of differences
constexpr double kLongestStep = 3;      // of x
constexpr int kTurnsByDifferences = 6;  // of numbers and matches
constexpr double kLeastPromise = 0.05;  // nats of Laplace's evidence: far below what decides
constexpr double kLeastOfExact = 1e-3;  // within 0.05 deviations of the maximum, which the evidences of shapes need

}  // namespace

MatrixXd metric_of(const MatrixXd& information) {
  const Eigen::SelfAdjointEigenSolver<MatrixXd> axes(information);
  return axes.eigenvectors() * axes.eigenvalues().cwiseMax(std::pow(kMostDeviation, -2)).asDiagonal() *
         axes.eigenvectors().transpose();
}

bool has_draws(const CohortModel& cohort) {
  return cohort.settings().importance_samples > 0 && cohort.shapes() >= kFewestSampled;
}

std::optional<Evidence> evidence_by_draws(const CohortModel& cohort, const Matches& about,
                                          std::vector<MatrixXd>& starts) try {
  const int draws = std::clamp(kDrawsOfCohort / cohort.shapes(), kFewestDraws, kMostDraws);
  const SampledCohort sampled = sample_cohort(cohort, about.x, about, draws, starts);
  if (!sampled.enough) return std::nullopt;
  const double of_mean = cohort.of_own_mean(about.x);
  Evidence evidence{sampled.log_evidence + of_mean, VectorXd(kDrawGroups)};
  for (int g = 0; g < kDrawGroups; ++g) evidence.without_group[g] = sum_of_log_means(sampled.log_sets, g) + of_mean;
  return evidence;
} catch (const Error&) {
  return std::nullopt;
}

std::optional<Evidence> evidence_by_draws(const CohortModel& cohort, const Matches& about) {
  std::vector<MatrixXd> starts;
  return has_draws(cohort) ? evidence_by_draws(cohort, about, starts) : std::nullopt;
}

Box trusted_about(const VectorXd& x, const MatrixXd& metric, const Box& box, double part) {
  const VectorXd reach = part * kTrusted * metric.diagonal().cwiseSqrt().cwiseInverse().cwiseMin(kMostTrusted);
  return {(x - reach).cwiseMax(box.least).cwiseMin(box.most), (x + reach).cwiseMax(box.least).cwiseMin(box.most)};
}

namespace {

double value_of(const Correction& correction, const VectorXd& x) {
  const VectorXd step = x - correction.x;
  return correction.slope.dot(step) - 0.5 * step.dot(correction.bend * step);
}

VectorXd slope_of(const Correction& correction, const VectorXd& x) {
  return correction.slope - correction.bend * (x - correction.x);
}

}  // namespace

AddedByDraws::AddedByDraws(Correction of_laplace, Box known)
    : of_laplace_(std::move(of_laplace)), known_(std::move(known)) {}

double AddedByDraws::value(const VectorXd& x) const {
  return of_laplace_ ? value_of(*of_laplace_, known_.clipped(x)) : 0;
}

void AddedByDraws::add_to(SecondOrder& evidence, const VectorXd& x) const {
  if (!of_laplace_) return;
  const VectorXd inside = known_.clipped(x);
  evidence.value += value_of(*of_laplace_, inside);
  const VectorXd is_inside = (inside.array() == x.array()).cast<double>();
  evidence.gradient += slope_of(*of_laplace_, inside).cwiseProduct(is_inside);
  evidence.information += is_inside.asDiagonal() * of_laplace_->bend * is_inside.asDiagonal();
}

CorrectedEvidence::CorrectedEvidence(const CohortModel& cohort, const Matches& about, Correction correction,
                                     AddedByDraws added)
    : cohort_(cohort), about_(about), correction_(std::move(correction)), added_(std::move(added)) {}

double CorrectedEvidence::value(const VectorXd& x) const {
  return cohort_.linear_value(about_, x) + value_of(correction_, x) + added_.value(x);
}

SecondOrder CorrectedEvidence::at(const VectorXd& x) const {
  SecondOrder found = cohort_.linear_evidence(about_, x);
  found.value += value_of(correction_, x);
  found.gradient += slope_of(correction_, x);
  found.information += correction_.bend;
  added_.add_to(found, x);
  return found;
}

namespace {

Correction correction_of(const CohortModel& cohort, const Matches& about, const LocalEvidence& found) {
  const SecondOrder linear = cohort.linear_evidence(about, about.x);
  return {about.x, found.slope.gradient - linear.gradient, found.slope.information - linear.information};
}

}  // namespace

Correction correction_about(const CohortModel& cohort, const Matches& about, const Box& box,
                            CohortModel::Effort effort) {
  const auto evidence = [&](const VectorXd& x) -> std::optional<Evidence> {
    try {
      return Evidence{cohort.match(x, &about, effort).log_evidence, {}};
    } catch (const NumericalError&) {
      return std::nullopt;
    }
  };
  const MatrixXd metric = metric_of(cohort.linear_evidence(about, about.x).information);
  return correction_of(cohort, about, evidence_about(evidence, about.x, {about.log_evidence, {}}, metric, box));
}

matching::NewtonMaximum greatest_corrected(const CohortModel& cohort, const Matches& about,
                                           const Correction& correction, const AddedByDraws& added, const Box& box) {
  const CorrectedEvidence evidence(cohort, about, correction, added);
  const MatrixXd information = evidence.at(about.x).information;
  return maximise_by_newton([&](const VectorXd& x) { return evidence.value(x); },
                            [&](const VectorXd& x) { return evidence.at(x); },
                            trusted_about(about.x, metric_of(information), box), box.clipped(about.x));
}

void turn_by_turn(const CohortModel& cohort, Matches& best, Correction& correction, const AddedByDraws& added,
                  const Box& box, CohortModel::Effort effort) {
  const double least_promise = effort == CohortModel::Effort::kRough ? kLeastPromise : kLeastOfExact;
  correction.x = best.x;
  bool is_found = false;
  for (int turn = 0; turn < kTurnsByDifferences; ++turn) try {
      const matching::NewtonMaximum there = greatest_corrected(cohort, best, correction, added, box);
      const double promised = there.about.value - best.log_evidence - added.value(best.x);
      if (promised < least_promise) break;
      Matches next = cohort.match(there.x, &best, effort);
      const double gain = next.log_evidence + added.value(next.x) - best.log_evidence - added.value(best.x);
      if (gain > 0) {
        correction.move_to(next.x);
        best = std::move(next);
      }
      if (gain > promised / 2) continue;
      if (is_found && gain <= 0) break;
      correction = correction_about(cohort, best, box, effort);
      is_found = true;
    } catch (const NumericalError&) {
      break;  // what was found stands
    }
}

EvidenceSurface::EvidenceSurface(const CohortModel& cohort, Matches about, bool sampled)
    : cohort_(&cohort), about_(std::move(about)), sampled_(sampled && has_draws(cohort)) {
  std::optional<Evidence> here = evidence_of(about_);
  if (!here) {
    sampled_ = false;
    here = evidence_of(about_);
  }
  local_.here = *std::move(here);
  measure();
}

std::optional<Matches> EvidenceSurface::matches_at(const VectorXd& x) const try {
  Matches there = cohort_->match(x, &about_);
  if (!there.all_converged() && about_.all_converged()) return std::nullopt;
  return there;
} catch (const Error&) {
  return std::nullopt;
}

std::optional<Evidence> EvidenceSurface::evidence_of(const Matches& matches) {
  if (!sampled_) return Evidence{matches.log_evidence, {}};
  if (is_frozen_) return added_->to(matches.log_evidence, matches.x);
  return evidence_by_draws(*cohort_, matches, starts_);
}

bool EvidenceSurface::renew() {
  if (!is_frozen_ || added_->all.x == x()) return false;
  std::optional<Evidence> here = evidence_by_draws(*cohort_, about_, starts_);
  if (!here) return false;
  is_frozen_ = false;
  local_.here = *std::move(here);
  measured_at_.resize(0);
  return measure();
}

bool EvidenceSurface::is_far() const {
  const VectorXd way = x() - measured_at_;
  return way.dot(metric_of(local_.slope.information) * way) > kFar * kFar;
}

bool EvidenceSurface::measure() {
  if (measured_at_.size() > 0 && measured_at_ == x()) return false;
  measured_at_ = x();
  const MatrixXd metric = metric_of(cohort_->linear_evidence(about_, x()).information);
  const Index groups = local_.here.without_group.size();
  std::map<std::vector<double>, double> of_laplace;
  const auto key = [](const VectorXd& place) { return std::vector<double>(place.begin(), place.end()); };
  bool is_missing = false;
  local_ = evidence_about(
      [&](const VectorXd& to) -> std::optional<Evidence> {
        const std::optional<Matches> there = matches_at(to);
        if (!there) return std::nullopt;
        std::optional<Evidence> evidence = evidence_of(*there);
        if (evidence)
          of_laplace[key(to)] = there->log_evidence;
        else
          is_missing = true;
        return evidence;
      },
      x(), local_.here, metric, cohort_->box());
  if (is_frozen_ || !sampled_) return true;
  const auto laplace = [&](const VectorXd& to) -> std::optional<Evidence> {
    const auto found = of_laplace.find(key(to));
    if (found == of_laplace.end()) return std::nullopt;
    return Evidence{found->second, VectorXd::Zero(groups)};
  };
  added_ = {local_,
            evidence_about(laplace, x(), {about_.log_evidence, VectorXd::Zero(groups)}, metric, cohort_->box())};
  if (is_missing) {
    is_frozen_ = true;
    measured_at_.resize(0);
    return measure();
  }
  return true;
}

Correction EvidenceSurface::Added::correction() const {
  return {all.x, all.slope.gradient - of_laplace.slope.gradient, all.slope.information - of_laplace.slope.information};
}

Evidence EvidenceSurface::Added::to(double laplace, const VectorXd& x) const {
  const VectorXd step = x - all.x;
  const double bend = 0.5 * step.dot((all.slope.information - of_laplace.slope.information) * step);
  const double change = laplace - of_laplace.here.value - of_laplace.slope.gradient.dot(step) - bend;
  return {all.here.value + all.slope.gradient.dot(step) + change,
          (all.here.without_group + all.gradients_without_group.transpose() * step).array() + change};
}

Correction EvidenceSurface::correction_of_laplace() const {
  Correction found = correction();
  if (!added_) return found;
  Correction added = added_->correction();
  added.move_to(x());
  return {x(), found.slope - added.slope, found.bend - added.bend};
}

std::optional<Evidence> EvidenceSurface::drawn(const Matches& there) {
  if (!sampled_ || is_frozen_) return std::nullopt;
  return evidence_of(there);
}

AddedByDraws EvidenceSurface::by_draws() const {
  if (!added_) return {};
  const MatrixXd metric = metric_of(added_->all.slope.information);
  return {added_->correction(), trusted_about(added_->all.x, metric, cohort_->box())};
}

Correction EvidenceSurface::correction() const { return correction_of(*cohort_, about_, local_); }

EvidenceSurface::Promise EvidenceSurface::greatest(double part, const Box& box) const {
  const MatrixXd metric = metric_of(local_.slope.information);
  const Box near = trusted_about(x(), metric, box, part);
  Box within = near;
  if (is_frozen_) {
    const Box known = trusted_about(added_->all.x, metric, box);
    within = {near.least.cwiseMax(known.least.cwiseMin(x())), near.most.cwiseMin(known.most.cwiseMax(x()))};
  }
  const CorrectedEvidence evidence(*cohort_, about_, correction());
  const matching::NewtonMaximum best = maximise_by_newton(
      [&](const VectorXd& to) { return evidence.value(to); }, [&](const VectorXd& to) { return evidence.at(to); },
      within, x(), {.tolerance = kAtMaximum / 4, .longest_step = kLongestStep});
  Promise promise{best.x, best.about.value - evidence.value(x()), true};
  for (Index i = 0; i < best.x.size(); ++i)
    if ((best.x[i] <= near.least[i] && near.least[i] > box.least[i]) ||
        (best.x[i] >= near.most[i] && near.most[i] < box.most[i]))
      promise.inside = false;
  return promise;
}

// The slope there is that of the model here and, along the way, twice by what the evidence rose more than this had, as
// if it bent evenly; by no more than what it promised, as the slope across is unknown. Without draws differences are
// cheap.
bool EvidenceSurface::go_to(const VectorXd& to, double most_lost) try {
  Matches next = cohort_->match(to, &about_);
  std::optional<Evidence> there = evidence_of(next);
  if (!there && measured_at_ == x()) {
    is_frozen_ = true;
    there = evidence_of(next);
  }
  if (!there) return false;
  doubt_ = std::sqrt(jackknife_variance(there->without_group - local_.here.without_group));
  if (there->value < here() - most_lost) return false;
  const CorrectedEvidence evidence(*cohort_, about_, correction());
  const SecondOrder expected = evidence.at(next.x);
  const VectorXd step = next.x - x();
  const VectorXd image = metric_of(local_.slope.information) * step;
  const double rise = expected.value - evidence.value(x());
  const double more = std::clamp(there->value - here() - rise, -std::abs(rise), std::abs(rise));
  const VectorXd slope = expected.gradient + 2 * more / std::max(step.dot(image), 1e-12) * image;
  local_.gradients_without_group.colwise() += slope - local_.slope.gradient;
  local_.slope = {there->value, slope, expected.information};
  local_.here = *there;
  local_.x = next.x;
  about_ = std::move(next);
  if (!sampled_ || is_frozen_) measure();
  return true;
} catch (const NumericalError&) {
  return false;
}

}  // namespace pulson::compare
