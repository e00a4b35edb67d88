#pragma once

#include <optional>
#include <vector>

#include "cohort_model.hpp"
#include "evidence_maximum.hpp"

namespace pulson::compare {

/// Whether numbers are sought by draws: the settings have some, and shapes are so many that the deviations of numbers
/// are not far larger than the bias of Laplace's.
bool has_draws(const CohortModel& cohort);

/// The evidence at matches by as many draws as a search takes; none where they do not determine it.
/// @param starts of each shape, see sample_cohort()
std::optional<Evidence> evidence_by_draws(const CohortModel& cohort, const Matches& about,
                                          std::vector<Eigen::MatrixXd>& starts);
std::optional<Evidence> evidence_by_draws(const CohortModel& cohort, const Matches& about);

/// Fisher's information with eigenvalues of at least that of a deviation of 2, for steps of numbers that are hardly
/// determined.
Eigen::MatrixXd metric_of(const Eigen::MatrixXd& information);

/// Where an evidence known to second order about x is trusted. @param part of the way from there to its sides
Box trusted_about(const Eigen::VectorXd& x, const Eigen::MatrixXd& metric, const Box& box, double part = 1);

/// By how much the evidence differs from that of linear models near a place, to second order.
struct Correction {
  Eigen::VectorXd x;
  Eigen::VectorXd slope;
  Eigen::MatrixXd bend;  ///< what is added to the information

  void move_to(const Eigen::VectorXd& to) {
    slope -= bend * (to - x);
    x = to;
  }
};

/// What draws add to Laplace's evidence: to second order within a box, beyond it what it is at the box. (Of 20 ovals
/// the parabola went on to 25 nats where draws have none.)
class AddedByDraws {
 public:
  /// Nothing.
  AddedByDraws() = default;
  AddedByDraws(Correction of_laplace, Box known);

  /// But for a constant.
  double value(const Eigen::VectorXd& x) const;
  /// Takes that which is to first order.
  void add_to(SecondOrder& evidence, const Eigen::VectorXd& x) const;

 private:
  std::optional<Correction> of_laplace_;
  Box known_;
};

/// The evidence of linear models, what Laplace's lacks there, and what draws add, which costs no match: Laplace's has
/// in addition what matches that move change of the determinants.
class CorrectedEvidence {
 public:
  /// @param cohort, about are referred to
  CorrectedEvidence(const CohortModel& cohort, const Matches& about, Correction correction, AddedByDraws added = {});
  CorrectedEvidence(const CohortModel& cohort, Matches&& about, Correction correction,
                    AddedByDraws added = {}) = delete;

  double value(const Eigen::VectorXd& x) const;
  SecondOrder at(const Eigen::VectorXd& x) const;

 private:
  const CohortModel& cohort_;
  const Matches& about_;
  Correction correction_;
  AddedByDraws added_;
};

/// Of Laplace's evidence, by differences between rough matches, of numbers that the box leaves free.
Correction correction_about(const CohortModel& cohort, const Matches& about, const Box& box,
                            CohortModel::Effort effort = CohortModel::Effort::kRough);
/// Where that evidence is greatest in a box, as far as it is trusted.
matching::NewtonMaximum greatest_corrected(const CohortModel& cohort, const Matches& about,
                                           const Correction& correction, const AddedByDraws& added, const Box& box);
/// Towards the greatest of that in a box: numbers and matches in turn, of which the best is kept. Where the evidence
/// does not rise by what is promised, as where data hardly determine σ, the correction is found anew.
/// @param effort of the matches, and of the maximum
void turn_by_turn(const CohortModel& cohort, Matches& best, Correction& correction, const AddedByDraws& added,
                  const Box& box, CohortModel::Effort effort = CohortModel::Effort::kRough);

/// The evidence near matches, by draws where these determine it, else Laplace's: that of the models linear about them,
/// and what differences showed that these lack.
class EvidenceSurface {
 public:
  /// @param cohort is referred to
  EvidenceSurface(const CohortModel& cohort, Matches about, bool sampled);

  const Matches& about() const { return about_; }
  const Eigen::VectorXd& x() const { return about_.x; }
  double here() const { return local_.here.value; }
  bool is_sampled() const { return sampled_; }
  /// To second order about x().
  const LocalEvidence& local() const { return local_; }
  /// Of the models linear about the matches there.
  Correction correction() const;
  /// Of that what Laplace's evidence lacks.
  Correction correction_of_laplace() const;
  AddedByDraws by_draws() const;
  /// The evidence of other matches by the draws; none where it is not known by them here or there.
  std::optional<Evidence> drawn(const Matches& there);
  /// The greatest within a box, as far as what was found is trusted. @param part of that far
  struct Promise {
    Eigen::VectorXd x;
    double gain = 0;
    bool inside = false;  ///< at no bound of that, but a number's own or the end of what draws determine
  };
  Promise greatest(double part, const Box& box) const;
  /// Whether x() is farther than half a deviation from where differences were taken.
  bool is_far() const;
  /// Takes differences about x(), unless that is where they were taken. @return whether they were
  bool measure();
  /// Does so by draws where what these add is that of another place. @return whether they determine the evidence
  bool renew();
  /// To another place, unless the evidence is so much less there; how it rose on the way corrects its slope. From where
  /// draws do not determine the evidence nearby, it is Laplace's and by_draws().
  bool go_to(const Eigen::VectorXd& x, double most_lost = kAtMaximum);
  /// The standard error, by the draws, of how much it rose on the last way that was tried.
  double doubt() const { return doubt_; }

 private:
  struct Added {
    LocalEvidence all, of_laplace;
    Correction correction() const;  ///< about all.x
    Evidence to(double laplace, const Eigen::VectorXd& x) const;
  };

  std::optional<Matches> matches_at(const Eigen::VectorXd& x) const;
  std::optional<Evidence> evidence_of(const Matches& matches);

  const CohortModel* cohort_;
  Matches about_;
  bool sampled_;
  std::vector<Eigen::MatrixXd> starts_;
  LocalEvidence local_;
  Eigen::VectorXd measured_at_{};
  bool is_frozen_ = false;  ///< what draws add is that of added_: they do not determine the evidence beside it
  double doubt_ = 0;
  std::optional<Added> added_;
};

}  // namespace pulson::compare
