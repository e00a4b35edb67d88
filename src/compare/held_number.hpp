#pragma once

#include <map>
#include <optional>

#include "evidence_surface.hpp"

namespace pulson::compare {

/// The evidence of a cohort, Laplace's and what may be added to it, maximised over all numbers but one, as a function
/// of that one: at each place matches and numbers in turn, by the models linear about the matches, from the neighbour
/// whose linear models promise most, and from the other where these promise more than was found. What is found from one
/// side is carried on to the other in the same way, as the evidence may have several maxima.
class HeldNumber {
 public:
  /// @param cohort is kept @param held of cohort.open() @param about matches at x, where the walk begins
  HeldNumber(const CohortModel& cohort, Eigen::Index held, Matches about,
             CohortModel::Effort effort = CohortModel::Effort::kRough);
  /// @param correction of the models linear about the matches @param added to Laplace's evidence
  HeldNumber(const CohortModel& cohort, Eigen::Index held, Matches about, Correction correction, AddedByDraws added);

  struct Place {
    Matches matches;
    Eigen::VectorXd shapes;  ///< their evidence
    Correction correction;   ///< what linear models about the matches lack
    double value = 0;        ///< the evidence, up to a constant
  };

  /// Where the walk began, which is not settled where x was no maximum.
  double start() const { return start_; }
  /// Finds the maximum at a place. Nothing where some shape has no path there.
  void visit(double place);
  /// The same at several, in order outwards from the start.
  void visit_all(const Eigen::VectorXd& rising);
  /// Matches at a place that were found otherwise, which are kept where they are better.
  void offer(double place, Matches matches);
  /// Null where nothing was found.
  const Place* at_place(double place) const;

 private:
  using Known = std::map<double, Place>;

  Known::iterator keep(double place, Place found);
  /// The greatest evidence at a place by the models linear about its neighbour's matches.
  struct Promise {
    Eigen::VectorXd x;
    double value = 0;
  };
  Promise promise(double place, const Place& near) const;
  std::optional<Place> from(const Place& near, const Promise& to) const;
  bool improve(Known::iterator place, const Place& near);
  void carry_up(Known::iterator from_here);
  void carry_down(Known::iterator from_here);
  Place settled(Matches best, Correction correction) const;
  Box box_at(double place) const;

  const CohortModel& cohort_;
  Eigen::Index held_;
  AddedByDraws added_;
  CohortModel::Effort effort_ = CohortModel::Effort::kRough;
  double start_;
  Known known_;
};

}  // namespace pulson::compare
