#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pulson/matching/data_term.hpp"

namespace pulson {

/// Polygonal curves: vertices, d×N, and the pairs (a, b) of them that an edge joins, from a to b.
struct Curve {
  Points points;
  std::vector<std::pair<int, int>> edges;
};

/// Whether the last landmark of an outline is joined to its first one. Automatic: where the gap between them is at most
/// twice the median length of the outline's other edges.
enum class CurveEnds { kAuto, kClosed, kOpen };

/// @throws InputError that lists `auto`, `closed`, `open`
CurveEnds parse_curve_ends(std::string_view name);
std::string curve_ends_name(CurveEnds ends);

/// Joins consecutive landmarks of each group, and the ends of a group of at least three as `ends` says.
/// @throws InputError on the line, and for a group of fewer than two landmarks
Curve make_curve(const Landmarks& shape, CurveEnds ends);

/// How edges with the vectors s and t are compared. A current depends on the orientation of a curve: reversing
/// the order of the landmarks turns it into its negative, which costs more than no curve at all, and branches that run
/// to and fro cancel. A varifold ignores orientation.
enum class CurveMeasure {
  kCurrent,   ///< g(s,t) = s·t
  kVarifold,  ///< g(s,t) = (s·t)²/(|s||t|), 0 where s or t is 0
};

/// A tenth of the diameter of the curve, but at least two median lengths of its edges, so that the sums over edges are
/// near to the integrals along the curve; 0 for no curve.
double automatic_data_width(const Curve& target);

struct CurveTermOptions {
  CurveMeasure measure = CurveMeasure::kVarifold;
  double sigma = 0;  ///< standard deviation of the observation, length units: must be given
  double width = 0;  ///< w, length units, must be given: smaller features are ignored; see automatic_data_width()
};

/// Holds a curve with vertices q near a target curve y, with no correspondence of points: in a Hilbert space of
/// measures
///
///     D(q) = (s/2σ²)|μ_q − μ_y|²,   <μ,ν> = Σ_e Σ_f exp(−|c_e − c_f|²/w²) g(t_e, t_f),
///
/// e over the edges of μ and f over those of ν, c the middle and t the vector of an edge, g that of the measure
/// (currents: Vaillant and Glaunès 2005, Glaunès et al. 2008; varifolds: Charon and Trouvé 2013).
///
/// s makes σ comparable with that of landmarks: N(d−1)/Σ_axis 1ᵀG(y)1, N the number of vertices of the source and 1 the
/// translation along an axis. A translation of the target itself by a small δ then costs, averaged over directions,
/// (N(d−1)/d)|δ|²/(2σ²): as N landmarks would, but for the part of δ along the curve, which a curve does not see.
///
/// Gauss–Newton: FᵀF = (s/σ²)(G + εI), G = ∂²<μ_q, μ_q'>/∂q∂q' at q' = q. G is singular where motions of vertices along
/// the curve leave the measure as it is; the ridge ε = 1e-9 tr G/(dN) gives F = √s/σ Lᵀ, LLᵀ = G + εI, an inverse, so
/// that Fᵀr = ∂D/∂q holds but for rounding.
///
/// An edge of no length counts for nothing in a varifold, and its derivative, which has no limit there, is taken as 0.
/// D is a difference of sums: rounding leaves about 1e-16 (s/σ²)|μ_y|² of it near the target, but little of ∂D/∂q.
/// Cost: O(E(E + M)) for E and M edges, linearise() also O((dN)³) time and O((dN)²) memory.
class CurveTerm final : public DataTerm {
 public:
  /// @param source_edges how the N = `source_vertices` vertices q are joined
  /// @throws InputError if d is not 2 or 3, an edge joins no two vertices, a number is not finite, sigma or width is
  /// not positive, or the target's measure is 0
  CurveTerm(std::vector<std::pair<int, int>> source_edges, int source_vertices, Curve target, CurveTermOptions options);

  double value(const Points& q) const override;
  Points gradient(const Points& q) const override;
  Linearisation linearise(const Points& q, const Eigen::MatrixXd& changes) const override;

 private:
  void check_shape(const Points& q) const;

  std::vector<std::pair<int, int>> edges_;
  int count_;
  Curve target_;
  CurveTermOptions options_;
  double target_square_;  ///< |μ_y|²
  double weight_;         ///< s/σ²
};

}  // namespace pulson
