#include "pulson/cohort/transport.hpp"

#include <numeric>

#include <fmt/format.h>

#include "core/text.hpp"
#include "geodesics.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"

namespace pulson::cohort {
namespace {

using Eigen::Index;

constexpr double kReached = 1e-13;  // defect, in diameters
constexpr double kFailed = 1e-9;    // one that is no round-off

// exp and log, with the same steps for each geodesic.
class Shooting {
 public:
  Shooting(const KernelOperator& kernel, int steps) : geodesics_(kernel, steps) {}

  Points exp(const Points& q, const Points& p) const { return geodesics_.shoot(q, p).q; }

  Points log(const Points& q, const Points& target) const {
    const TemplateMetric metric(geodesics_.kernel(), 0, 0, q);
    std::vector<Index> all(static_cast<std::size_t>(q.cols()));
    std::iota(all.begin(), all.end(), 0);
    const double size = diameter(q);
    const GeodesicMatch found =
        geodesics_.match(metric, MatchModel(metric, all), target, Points::Zero(q.rows(), q.cols()), kReached * size);
    if (found.defect > kFailed * size)
      throw NumericalError("a piece of the transport has no geodesic: take more rungs");
    return found.momenta;
  }

 private:
  Geodesics geodesics_;
};

}  // namespace

Points transported(const KernelOperator& kernel, const Points& q0, const Points& along, const Points& momentum,
                   const TransportOptions& options) {
  const SerialBlas serial;
  if (options.rungs < 1) throw InputError(fmt::format("rungs is {}; it must be at least 1", options.rungs));
  if (options.steps < 1) throw InputError(fmt::format("steps is {}; it must be at least 1", options.steps));
  require_size("the momenta along", along, q0.rows(), q0.cols());
  require_size("the momenta", momentum, q0.rows(), q0.cols());
  // Places at the ends and in the middle of each piece, all of one path.
  const int halves = (options.steps + 1) / 2, pieces = 2 * options.rungs;
  const Trajectory path = Geodesics(kernel, pieces * halves).path(q0, along);
  const auto place = [&](int half) { return path.states[static_cast<std::size_t>(half * halves)].q; };
  const Shooting shooting(kernel, options.steps);
  const double scale = 1.0 / (1.0 * options.rungs * options.rungs);
  Points p = scale * momentum;
  for (int rung = 0; rung < options.rungs; ++rung) {
    const Points middle = place(2 * rung + 1);
    const Points opposite = shooting.exp(middle, -shooting.log(middle, shooting.exp(place(2 * rung), p)));
    p = -shooting.log(place(2 * rung + 2), opposite);
  }
  return p / scale;
}

}  // namespace pulson::cohort
