// Registrations, and paths that are shot.

#include <chrono>
#include <cmath>
#include <cstdint>
#include <memory>
#include <optional>

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "core/step_watch.hpp"
#include "formats/held_shapes.hpp"
#include "match.hpp"
#include "matching/defaults.hpp"
#include "models.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/ensemble/ensemble.hpp"
#include "pulson/random/brownian.hpp"
#include "pulson/records/records.hpp"
#include "register/arguments.hpp"
#include "register/pair.hpp"
#include "register/registration_warnings.hpp"
#include "register/summary.hpp"
#include "runs.hpp"
#include "shell/verbs.hpp"

namespace pulson::python {
namespace {

using matching::Registration;

/// Positions and momenta of a path.
struct Shot {
  Trajectory path;
};

template <class Part>
py::array states_of(const Trajectory& path, const Part& part) {
  if (path.states.empty()) return stack_of({});
  const Points& first = part(path.states.front());
  py::array_t<double> stack(
      std::vector<py::ssize_t>{static_cast<py::ssize_t>(path.states.size()), first.cols(), first.rows()});
  double* to = stack.mutable_data();
  for (const PhaseState& state : path.states) {
    const Points& points = part(state);
    to = std::copy(points.data(), points.data() + points.size(), to);
  }
  return stack;
}

py::array times_of(const TimeGrid& grid, std::size_t states) {
  py::array_t<double> times(static_cast<py::ssize_t>(states));
  for (std::size_t k = 0; k < states; ++k) times.mutable_at(k) = grid.at(static_cast<int>(k));
  return times;
}

// Where no option is given the words are the same in each call, and none of them has an effect but on the arguments:
// they are parsed once, as that takes a tenth of what a call costs beside its search.
RegisterArguments arguments_of(std::vector<std::string> words) {
  const bool has_options = !words.empty();
  words.insert(words.end(), {"--out=-", "source", "target"});
  if (has_options) return hosted_arguments<RegisterArguments>(words);
  static const auto without_options = hosted_arguments<RegisterArguments>(words);
  return without_options;
}

py::dict register_pair(const Landmarks& source, const Landmarks& target, const std::vector<std::string>& words,
                       const std::optional<Doubles>& weights, const std::shared_ptr<const NoiseModel>& own_noise,
                       py::object progress) {
  Said said;
  Eigen::VectorXd own_weights;
  if (weights) own_weights = Eigen::Map<const Eigen::VectorXd>(weights->data(), weights->size());
  const RunOptions run{std::move(progress), true, &said};
  auto match = in_host<std::shared_ptr<Match>>(
      [&] {
        const RegisterArguments arguments = arguments_of(words);
        Progress shown;
        PairTask task = pair_task(arguments, source, target, {}, shown);
        if (own_weights.size() > 0) task.options.data.weights = own_weights;
        if (own_noise) {
          own_noise->check(source.dimension(), source.count());
          task.options.noise = own_noise;
        }
        const auto fitted = fit_first(arguments, task, shown);
        const Interrupt look_for_stops;
        PairMatch pair = match_pair(arguments, task, fitted, shown);
        print_notes(task.notes);
        if (pair.registration.noise == "none" && task.options.noise.spec() != "none")
          print_note(fmt::format("mode deterministic does not use the noise '{}'", task.options.noise.spec()));
        if (!pair.facts.finding.empty()) print_warning(pair.facts.finding);
        for (const std::string& text : result_warnings(pair.registration)) print_warning(text);
        return std::make_shared<Match>(std::move(pair.registration), std::move(pair.facts), arguments.kernel);
      },
      run);
  py::dict result;
  result["match"] = match;
  result["warnings"] = said.warnings;
  result["notes"] = said.notes;
  return result;
}

std::string summary_of(const Match& match) {
  if (!match.asked_kernel()) return {};  // it was read
  Said said;
  run_hosted([&] { print_registration(match.registration(), match.facts(), *match.asked_kernel()); },
             {py::none(), true, &said});
  return said.printed;
}

std::shared_ptr<Match> read_match(const std::string& text, const std::string& name) {
  return std::make_shared<Match>(records::registration_of(text, name), text);
}

TimeGrid grid_of(double time, std::optional<int> steps, std::optional<double> dt) {
  TimeOptions options = TimeOptions::of(matching::path_defaults());
  options.time = time;
  options.chosen = steps || dt;
  if (steps) {
    options.steps = *steps;
    options.dt.reset();
  }
  if (dt) options.dt = dt;
  return options.grid();
}

// Once in a while: the lock of the interpreter has to be taken for it.
void look_for_signals() {
  using Clock = std::chrono::steady_clock;
  thread_local Clock::time_point looked = Clock::now();
  if (Clock::now() - looked < std::chrono::milliseconds(50)) return;
  {
    const py::gil_scoped_acquire python;
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  looked = Clock::now();
}

std::shared_ptr<Shot> shoot(const py::handle& q, const py::handle& p, const py::handle& kernel, const py::handle& noise,
                            double time, std::optional<int> given_steps, std::optional<double> dt,
                            const std::string& integrator, const py::object& increments, std::uint64_t seed) {
  PhaseState start{points_of(q, "q"), points_of(p, "p")};
  if (start.q.rows() != start.p.rows() || start.q.cols() != start.p.cols())
    throw InputError(fmt::format("p has {} landmarks in {}D, q {} in {}D", start.p.cols(), start.p.rows(),
                                 start.q.cols(), start.q.rows()));
  if (start.q.cols() == 0) throw InputError("q has no landmarks");
  if (!start.q.allFinite() || !start.p.allFinite()) throw InputError("q and p must be finite");
  const TimeGrid grid = grid_of(time, given_steps, dt);
  const int steps = grid.steps;
  StochasticSystem system{kernel_of(kernel, start.q), noise_of(noise, start.q)};
  const int d = static_cast<int>(start.q.rows()), n = static_cast<int>(start.q.cols());
  system.noise->check(d, n);
  const int channels = system.noise->channels(d, n);
  Eigen::MatrixXd dw;
  if (!increments.is_none()) {
    const Doubles given = doubles_of(increments, "increments");
    if (given.ndim() != 2 || given.shape(0) != steps || given.shape(1) != channels)
      throw InputError(fmt::format("increments must have the shape (steps, channels) = ({}, {})", steps, channels));
    dw = Eigen::Map<const Eigen::MatrixXd>(given.data(), channels, steps);
  }
  auto shot = std::make_shared<Shot>();
  const py::gil_scoped_release others_run;
  if (dw.size() == 0) dw = channels > 0 ? brownian_increments(seed, 0, channels, grid) : Eigen::MatrixXd(0, steps);
  const StepWatch::OfThread watch(look_for_signals);
  shot->path = make_integrator(integrator)->integrate(system, start, grid, dw);
  return shot;
}

}  // namespace

void add_registrations(py::module_& module) {
  py::class_<Shot, std::shared_ptr<Shot>>(module, "Trajectory", "A path of landmarks: q and p, (steps + 1, N, d).")
      .def_property_readonly("q",
                             [](const Shot& self) {
                               return states_of(self.path, [](const PhaseState& s) -> const Points& { return s.q; });
                             })
      .def_property_readonly("p",
                             [](const Shot& self) {
                               return states_of(self.path, [](const PhaseState& s) -> const Points& { return s.p; });
                             })
      .def_property_readonly(
          "end", [](const py::object& self) { return view_of(self.cast<Shot&>().path.states.back().q, self); })
      .def_property_readonly(
          "end_momenta", [](const py::object& self) { return view_of(self.cast<Shot&>().path.states.back().p, self); })
      .def_property_readonly("times",
                             [](const Shot& self) { return times_of(self.path.grid, self.path.states.size()); })
      .def_property_readonly("increments",
                             [](const py::object& self) { return view_of(self.cast<Shot&>().path.increments, self); })
      .def_property_readonly("integrator", [](const Shot& self) { return self.path.integrator; })
      .def("__repr__", [](const Shot& self) {
        return fmt::format("<Trajectory: {} landmarks in {}D, {} steps of {:.4g}>", self.path.initial().q.cols(),
                           self.path.initial().q.rows(), self.path.grid.steps, self.path.grid.dt());
      });

  const auto array = [](const Eigen::MatrixXd Registration::*member) {
    return [member](const py::object& self) { return view_of(self.cast<Match&>().registration().*member, self); };
  };
  py::class_<Match, std::shared_ptr<Match>>(module, "_Match")
      .def_property_readonly("momenta", array(&Registration::momenta))
      .def_property_readonly("result", array(&Registration::result))
      .def_property_readonly("increments", array(&Registration::increments))
      .def_property_readonly(
          "source",
          [](const py::object& self) { return view_of(self.cast<Match&>().registration().source.points, self); })
      .def_property_readonly(
          "target",
          [](const py::object& self) { return view_of(self.cast<Match&>().registration().target.points, self); })
      .def_property_readonly(
          "original",
          [](const py::object& self) { return view_of(self.cast<Match&>().registration().original.points, self); })
      .def_property_readonly("distances", [](const Match& self) { return array_of(self.registration().distances()); })
      .def_property_readonly("record_text",
                             [](const Match& self) {
                               const py::gil_scoped_release others_run;  // who holds the match's lock may call Python
                               return self.record();
                             })
      .def_property_readonly("summary", &summary_of)
      .def_property_readonly("has_own_noise",
                             [](const Match& self) { return self.registration().own_noise != nullptr; })
      .def_property_readonly("landmarks",
                             [](const Match& self) {
                               const Landmarks& source = self.registration().source;
                               py::array_t<std::int64_t> indices(source.count());
                               for (int a = 0; a < source.count(); ++a) indices.mutable_at(a) = source.number(a) - 1;
                               return indices;
                             })
      .def_property_readonly("own_kernels", [](const Match& self) { return own_kernels_of(self.kernel()); })
      .def_property_readonly("kernel", [](const Match& self) { return self.registration().kernel; })
      .def_property_readonly("noise", [](const Match& self) { return self.registration().noise; })
      .def_property_readonly("converged", [](const Match& self) { return self.registration().converged; })
      .def_property_readonly("matched", [](const Match& self) { return self.registration().matched(); })
      .def_property_readonly("rms", [](const Match& self) { return self.registration().rms(); })
      .def_property_readonly("seconds", [](const Match& self) { return self.registration().seconds; })
      .def("shoot", [](const Match& self) {
        const py::gil_scoped_release others_run;
        return std::make_shared<Shot>(Shot{self.path()});
      });

  module.def("_register_pair", &register_pair);
  module.def("_read_match", &read_match);
  add_warps(module);
  module.def("_shoot", &shoot);
  module.attr("_path_kernel") = matching::path_defaults().kernel.value;
  module.attr("_path_integrator") = matching::path_defaults().integrator.value;
}

}  // namespace pulson::python
