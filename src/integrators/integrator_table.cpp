#include "integrators/midpoint.hpp"
#include "integrators/runge_kutta.hpp"
#include "integrators/symmetric_variational.hpp"
#include "integrators/variational.hpp"

namespace pulson {
namespace {

using Made = std::unique_ptr<const Integrator>;

}  // namespace

const NameTable<MakeIntegrator>& integrator_table() {
  static const NameTable<MakeIntegrator> kTable(
      "integrator",
      {{"variational",
        {},
        "the stochastic variational integrator (20), compensated so that it converges to the Stratonovich equation "
        "(11) "
        "for every noise: symplectic, implicit in the positions",
        []() -> Made { return std::make_unique<VariationalIntegrator>(true); }},
       {"variational-paper",
        {},
        "(20) as printed: solves a different equation where noise moves positions and momenta together "
        "(ch-sd-screened, and p-sd except with constant fields), else the same as variational",
        []() -> Made { return std::make_unique<VariationalIntegrator>(false); }},
       {"variational-2",
        {},
        "half a step of the adjoint of (20), the noise, half a step of (20): symplectic, of order 2 without noise, of "
        "weak order 2 for additive noise; converges to (11) for every noise",
        []() -> Made { return std::make_unique<SymmetricVariationalIntegrator>(true); }},
       {"midpoint",
        {},
        "stochastic implicit midpoint: symplectic, of order 2 without noise",
        []() -> Made { return std::make_unique<MidpointIntegrator>(); }},
       {"heun",
        {},
        "Heun-Stratonovich: explicit, not symplectic",
        []() -> Made { return std::make_unique<RungeKuttaIntegrator>(heun_tableau()); }},
       {"rk4",
        {},
        "classical Runge-Kutta of order 4, without noise only: explicit, not symplectic",
        []() -> Made { return std::make_unique<RungeKuttaIntegrator>(rk4_tableau()); }},
       {"stormer-verlet", {}, "Störmer-Verlet, without noise only: symplectic, reversible, of order 2", []() -> Made {
          return std::make_unique<SymmetricVariationalIntegrator>(false);
        }}});
  return kTable;
}

std::unique_ptr<const Integrator> make_integrator(std::string_view name) {
  return integrator_table().find(name).make();
}

}  // namespace pulson
