#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "cell_interpolants.hpp"
#include "pulson/warp/sampled_map.hpp"

namespace pulson {

/// What the cells are halved for.
struct RefinementGoal {
  double tolerance = 0;  ///< pixels
  bool with_jacobians = false;
};

/// The cells between two rows of nodes, halved until interpolation in their quarters meets the goal.
class RefinedCells {
 public:
  /// @param cells that fill columns 0 to plane.columns − 1 and `rows`
  RefinedCells(const PlaneMap& map, const SampledPlane& plane, const NodeRange& rows, const RefinementGoal& goal,
               std::vector<PlaneCell> cells);

  /// The cells in the end, whose lattices are known.
  const std::vector<PlaneCell>& cells() const { return done_; }
  /// Of a node of one of their lattices.
  const ExactPlace& exact(const Node& node) const;
  CellPlaces places(const PlaneCell& cell) const;
  CellJacobians jacobians(const PlaneCell& cell) const;

  /// Largest differences from the exact map at the middles of their quarters.
  double error() const { return error_; }
  double jacobian_error() const { return jacobian_error_; }
  std::int64_t evaluations() const { return static_cast<std::int64_t>(known_.size()); }

 private:
  struct Tested {
    bool passed;
    double error, jacobian_error;
  };

  std::vector<PlaneCell> unfinished_quarters(const PlaneMap& map, double first, std::vector<PlaneCell> cells);
  bool finish(const PlaneCell& cell);
  std::size_t index_of(const Node& node) const;
  void ask(const Node& node);
  void answer(const PlaneMap& map, double first);
  bool may_pass(const PlaneCell& cell) const;
  Tested test_quarters(const PlaneCell& cell) const;
  Tested test_quarter(const PlaneCell& quarter, const CellJacobians* jacobians, const PlaneCell& cell) const;
  bool has_values(const PlaneCell& cell) const;
  bool has_no_places(const PlaneCell& cell) const;

  NodeRange rows_;
  std::size_t columns_;
  RefinementGoal goal_;
  std::vector<std::int32_t> numbers_;  ///< of nodes in known_; −1 for none
  std::vector<Node> asked_;            ///< known after the next answer
  std::vector<ExactPlace> known_;
  std::vector<PlaneCell> done_;
  double error_ = 0;
  double jacobian_error_ = 0;
};

}  // namespace pulson
