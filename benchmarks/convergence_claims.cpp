#include <algorithm>
#include <cmath>

#include "convergence.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson::convergence {
namespace {

constexpr double kSure = 4;  // standard errors that decide

Case make_case(const std::string& noise, const Points& q, const Points& p, bool commutes) {
  const Landmarks shape{.points = q, .labels = {}, .groups = {}, .name = {}, .source = {}};
  return {noise, {q, p}, {make_kernel("gaussian:alpha=1", q), make_noise(noise, shape)}, commutes};
}

}  // namespace

std::vector<Case> cases() {
  const Points q1 = Eigen::RowVector2d(0, 2);
  const Points p1 = Eigen::RowVector2d(2, 1);
  const Points q2 = (Points(2, 2) << 0, 1.5, 0, 1).finished();
  const Points p2 = (Points(2, 2) << 0.75, 0.25, 0.25, -0.25).finished();
  return {make_case("ch-sd:beta=1.5,on=2", q1, p1, true),
          make_case("trouve-vialard:sigma=0.5", q1, p1, true),
          make_case("langevin:sigma=0.5,friction=1", q1, p1, true),
          make_case("potential:beta=1,gamma=4", q1, p1, true),
          make_case("ch-sd-screened:beta=1,gamma=4,on=2", q1, p1, true),
          make_case("p-sd:beta=0.7,fields=cos,wavenumber=1", q1, 0.5 * p1, true),
          make_case("p-sd:beta=0.7,fields=cos,wavenumber=1", q2, p2, false),
          make_case("p-sd:beta=0.5,fields=grid,count=2", q2, p2, false),
          make_case("kunita:beta=0.5,width=2", q2, p2, false)};
}

bool lags(const std::string& integrator) { return integrator == "variational" || integrator == "variational-paper"; }

Claim claim_of(const Case& setting, const Row& row, Quantity quantity) {
  using Kind = Claim::Kind;
  const NoiseTraits noise = setting.system.noise->traits();
  const bool composed = row.integrator == "variational-2";
  const bool symmetric = composed || row.integrator == "midpoint" || row.integrator == "heun";
  if (!symmetric && !lags(row.integrator)) return {Kind::kIsAtLeast, is_weak(quantity) ? 1.0 : 0.5};
  const bool other_equation = row.integrator == "variational-paper" && noise.compensated;
  if (other_equation && row.limit == Limit::kStratonovich) return {Kind::kStalls, 0};
  // Additive noise: the mean of two slopes is right to second order in law. The slope at the mean sees half of the
  // curvature of H that it should.
  if (is_weak(quantity) && row.integrator == "heun") return {Kind::kIs, noise.additive ? 2.0 : 1.0};
  // The flow of noise between two half steps is exact where it is not solved for.
  if (is_weak(quantity)) return {Kind::kIs, composed && !noise.compensated ? 2.0 : 1.0};
  if (symmetric) return {Kind::kIs, setting.commutes ? 1 : 0.5};
  const bool lag_shows = quantity == kState || (quantity == kPosition && noise.moves_positions());
  return {Kind::kIs, lag_shows || noise.compensated || !setting.commutes ? 0.5 : 1};
}

Verdict compare(const Order& measured, const Claim& claim, Quantity quantity) {
  if (measured.points == 0) return Verdict::kUndecided;
  const double half_gap = is_weak(quantity) ? 0.5 : 0.25;
  const double above = measured.slope.value - claim.order;
  const double away = claim.kind == Claim::Kind::kIsAtLeast ? -above : std::abs(above);
  const double margin = kSure * measured.slope.error;
  if (away + margin < half_gap) return Verdict::kAgrees;
  return away - margin > half_gap ? Verdict::kDiffers : Verdict::kUndecided;
}

Verdict stalls(const Case& setting, const Measurement& measurement, Quantity quantity) {
  const auto own = std::ranges::find(measurement.rows, Limit::kPaper, &Row::limit);
  if (own == measurement.rows.end() || own->means[quantity].empty()) return Verdict::kUndecided;
  const auto at_least = [](const Estimate& e) { return std::abs(e.value) - kSure * e.error; };
  const auto at_most = [](const Estimate& e) { return std::abs(e.value) + kSure * e.error; };
  const double apart = at_least(measurement.limits_apart[quantity]);
  const bool near = at_most(own->means[quantity].back()) < apart;
  const bool converges =
      compare(own->orders[quantity], claim_of(setting, *own, quantity), quantity) == Verdict::kAgrees;
  return apart > 0 && (near || converges) ? Verdict::kAgrees : Verdict::kUndecided;
}

}  // namespace pulson::convergence
