#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <Eigen/Core>
#include <Eigen/SparseCore>

#include "pulson/core/landmarks.hpp"

namespace pulson::matching {

class LandmarkTerm;

/// A positive definite quadratic form, N×N.
struct QuadraticForm {
  Eigen::MatrixXd root;     ///< U, upper triangle: the form is UᵀU
  Eigen::MatrixXd inverse;  ///< (UᵀU)⁻¹
};

/// What holds the end points of a flow near its target: D(q), q = q(T), d×N, and a quadratic model of it,
///
///     D(q + δ) ≈ D(q) + ½|r + Fδ|² − ½|r|²,   Fᵀr = ∂D/∂q,
///
/// with FᵀF positive semi-definite: Gauss–Newton's approximation of the second derivatives. All methods are const and
/// thread-safe.
class DataTerm {
 public:
  struct Linearisation {
    Eigen::VectorXd residual;  ///< r
    Eigen::MatrixXd changes;   ///< FΔ, one column for each column of Δ
  };

  virtual ~DataTerm() = default;

  virtual double value(const Points& q) const = 0;

  /// ∂D/∂q, d×N.
  virtual Points gradient(const Points& q) const = 0;

  /// r and FΔ. @param changes Δ, dN×R (index a·d + axis)
  virtual Linearisation linearise(const Points& q, const Eigen::MatrixXd& changes) const = 0;

  /// Whether D = ½|r|² with F constant: then residual() is r.
  virtual bool is_least_squares() const { return false; }

  /// r. @throws std::logic_error unless is_least_squares()
  virtual Eigen::VectorXd residual(const Points& q) const;

  /// c of −log p(y | q) = D(q) + c/2, the density of data with Gaussian errors: log det(2πR).
  /// @throws std::logic_error unless is_least_squares()
  virtual double log_determinant() const;

  /// FᵀF, where it is the same for each axis, 0 between them, and constant; else null.
  virtual const QuadraticForm* form_of_each_axis() const { return nullptr; }

  /// This term, where the data are landmarks.
  virtual const LandmarkTerm* landmarks() const { return nullptr; }
};

/// Where landmarks were observed, and how well.
struct LandmarkObservations {
  Points target;              ///< y, d×N; a NaN is a coordinate that was not observed
  double sigma = 0;           ///< standard deviation of a coordinate, length units; must be given without covariances
  Eigen::VectorXd weights{};  ///< w, N numbers; empty: all 1; a landmark of weight 0 is left out
  std::vector<Eigen::MatrixXd> covariances{};  ///< R, N matrices d×d, length units squared; empty: σ²I
};

/// Landmarks observed with Gaussian errors,
///
///     D(q) = ½ Σ_a w_a (q_a − y_a)ᵀ R_a⁻¹ (q_a − y_a),
///
/// where of a landmark that was observed in part R_a is cut down to the coordinates that were: its marginal. With
/// R_a = LLᵀ the residual is r_a = √w_a L⁻¹(q_a − y_a).
class LandmarkTerm final : public DataTerm {
 public:
  /// @throws InputError if sizes do not fit together, sigma, a weight or a covariance is none, a coordinate is
  /// infinite, or nothing is observed
  explicit LandmarkTerm(const LandmarkObservations& observations);

  double value(const Points& q) const override;
  Points gradient(const Points& q) const override;
  Linearisation linearise(const Points& q, const Eigen::MatrixXd& changes) const override;
  bool is_least_squares() const override { return true; }
  Eigen::VectorXd residual(const Points& q) const override;

  const LandmarkTerm* landmarks() const override { return this; }

  /// y, d×N, with 0 for what is not observed.
  Points target() const { return target_.reshaped(dimension_, target_.size() / dimension_); }

  /// w_a R_a⁻¹, d×d, with rows and columns of 0 for what is not observed.
  Eigen::MatrixXd precision(Eigen::Index a) const;

  /// The same with other targets: y + shift. @param shift d×N, length units
  LandmarkTerm moved(const Points& shift) const;

  /// The same, each coordinate less certain: R_a/w_a + variance·I in place of R_a/w_a. @param variance length units
  /// squared
  LandmarkTerm blurred(double variance) const;

  /// Some of the landmarks, in the order given, with `weight` times their weights.
  /// @throws InputError if of these nothing is observed
  LandmarkTerm part(const std::vector<Eigen::Index>& landmarks, double weight) const;

  /// The length of r: how many coordinates are observed, with a weight above 0.
  Eigen::Index residuals() const { return whitening_.rows(); }

  /// Σ_a log det(2πR_a/w_a) over what is observed: −log of the density of y given q is D(q) plus half of it.
  double log_determinant() const override { return log_determinant_; }

 private:
  LandmarkObservations observations_;
  Eigen::Index dimension_;
  Eigen::VectorXd target_;                 ///< y, dN, with 0 for what is not observed
  Eigen::SparseMatrix<double> whitening_;  ///< F, of the blocks √w_a L⁻¹; by columns, which precision() takes
  std::optional<double> scale_;            ///< s where F = sI
  double log_determinant_ = 0;
};

/// |q_a − y_a| of each landmark over the coordinates observed, NaN where there are none. @param q, target d×N
Eigen::VectorXd distances(const Points& q, const Points& target);

/// The root mean square of those distances that there are; NaN where there are none.
double rms_distance(const Points& q, const Points& target);

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

}  // namespace pulson::matching
