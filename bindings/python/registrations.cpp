// A registration and what is done with it: the path shot again, points and pictures moved.

#include <cmath>
#include <map>
#include <memory>
#include <mutex>
#include <optional>

#include <Eigen/LU>
#include <fmt/format.h>
#include <pybind11/stl.h>

#include "formats/held_shapes.hpp"
#include "matching/defaults.hpp"
#include "models.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/ensemble/ensemble.hpp"
#include "pulson/random/brownian.hpp"
#include "pulson/records/records.hpp"
#include "pulson/warp/material_flow.hpp"
#include "register/arguments.hpp"
#include "register/pair.hpp"
#include "register/registration_warnings.hpp"
#include "runs.hpp"
#include "shell/verbs.hpp"
#include "warp/frames.hpp"
#include "warp/jobs.hpp"
#include "warp/points_frame.hpp"

namespace pulson::python {
namespace {

using matching::Registration;

/// A registration with what is made of it at most once.
class Match {
 public:
  Match(Registration registration, std::string record)
      : registration_(std::move(registration)), record_(std::move(record)) {}

  const Registration& registration() const { return registration_; }
  const std::string& record() const { return record_; }

  /// Thread-safe; without the interpreter's lock.
  const warp::MaterialFlow& flow(const std::string& labels) const {
    const std::lock_guard lock(mutex_);
    std::unique_ptr<const warp::MaterialFlow>& flow = flows_[labels];
    if (!flow)
      flow = std::make_unique<const warp::MaterialFlow>(registration_system(registration_), path_locked(),
                                                        warp::parse_label_kernel(labels));
    return *flow;
  }

  const Trajectory& path() const {
    const std::lock_guard lock(mutex_);
    return path_locked();
  }

 private:
  const Trajectory& path_locked() const {
    if (!path_) path_ = replay(registration_);
    return *path_;
  }

  Registration registration_;
  std::string record_;
  mutable std::mutex mutex_;
  mutable std::optional<Trajectory> path_;
  mutable std::map<std::string, std::unique_ptr<const warp::MaterialFlow>> flows_;
};

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

py::dict register_pair(const Landmarks& source, const Landmarks& target, const std::vector<std::string>& words,
                       const std::optional<Doubles>& weights, const std::shared_ptr<const NoiseModel>& own_noise,
                       py::object progress) {
  Said said;
  Eigen::VectorXd own_weights;
  if (weights) own_weights = Eigen::Map<const Eigen::VectorXd>(weights->data(), weights->size());
  const RunOptions run{std::move(progress), true, &said};
  auto match = in_host<std::shared_ptr<Match>>(
      [&] {
        RegisterArguments arguments;
        CLI::App options;
        arguments.add_to(options);
        std::vector<std::string> all = words;
        all.insert(all.end(), {"--out=-", "source", "target"});
        parse_hosted(options, all);
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
        std::string record = registration_json(pair.registration, pair.facts);
        return std::make_shared<Match>(std::move(pair.registration), std::move(record));
      },
      run);
  py::dict result;
  result["match"] = match;
  result["warnings"] = said.warnings;
  result["notes"] = said.notes;
  return result;
}

std::shared_ptr<Match> read_match(const std::string& text, const std::string& name) {
  return std::make_shared<Match>(records::registration_of(text, name), text);
}

// NaN stays where a point misses a coordinate.
Points known_columns(const Points& points, std::vector<Eigen::Index>& known) {
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    if (!points.col(i).hasNaN()) known.push_back(i);
  return points(Eigen::all, known);
}

// As `warp` moves points that are in the coordinates of the registration's source, or with `inverse` of its target.
Points moved(const Match& match, const Points& points, const std::string& labels, bool inverse, bool with_gradients,
             Eigen::VectorXd& jacobians) {
  const Registration& registration = match.registration();
  const warp::MaterialFlow& flow = match.flow(labels);
  if (points.rows() != flow.dimension())
    throw InputError(fmt::format("points are in {}D, the registration in {}D", points.rows(), flow.dimension()));
  std::vector<Eigen::Index> known;
  const Points from = known_columns(points, known);
  const Alignment& alignment = registration.alignment;
  warp::MovedPoints to;
  if (inverse) {
    to = flow.inverse(from);
    to.places = (alignment.scale * alignment.linear).inverse() * (to.places.colwise() - alignment.translation);
  } else {
    to = flow.end_with_gradients(alignment.apply(from));
  }
  if (!to.places.allFinite()) throw NumericalError("points: one is moved out of the range of numbers");
  Points result = Points::Constant(points.rows(), points.cols(), std::nan(""));
  result(Eigen::all, known) = to.places;
  if (with_gradients) {
    jacobians = Eigen::VectorXd::Constant(points.cols(), std::nan(""));
    if (!known.empty()) jacobians(known) = to.jacobians();
  }
  return result;
}

py::object warp_points(const Match& match, const py::handle& values, bool inverse, const std::string& labels,
                       bool jacobians) {
  const Points points = points_of(values, "points");
  Points result;
  Eigen::VectorXd determinants;
  {
    const py::gil_scoped_release others_run;
    result = moved(match, points, labels, inverse, jacobians, determinants);
  }
  const py::array array = array_of(std::move(result));
  if (!jacobians) return array;
  return py::make_tuple(array, array_of(determinants));
}

// Shapes of files, in their own frames.
Landmarks warp_shape(const Match& match, Landmarks shape, bool inverse, const std::string& labels) {
  const py::gil_scoped_release others_run;
  const Registration& registration = match.registration();
  const PointsFrame frame(inverse ? registration.target : registration.original,
                          inverse ? registration.original : registration.target);
  const Frame own = shape.frame;
  std::vector<std::string> notes;
  shape = frame.enter(std::move(shape), notes);
  Eigen::VectorXd unused;
  for (Points* block : {&shape.points}) *block = moved(match, *block, labels, inverse, false, unused);
  for (auto* lines : {&shape.curves, &shape.outlines})
    for (Points& line : *lines)
      if (line.cols() > 0) line = moved(match, line, labels, inverse, false, unused);
  frame.leave(shape, own);
  shape.image.clear();
  shape.scale.reset();
  return shape;
}

template <class Value>
images::Image image_with(const py::array& pixels) {
  const auto values = py::array_t<Value, py::array::c_style | py::array::forcecast>::ensure(pixels);
  const int channels = pixels.ndim() == 3 ? static_cast<int>(pixels.shape(2)) : 1;
  return {static_cast<int>(pixels.shape(1)), static_cast<int>(pixels.shape(0)), channels,
          std::span<const Value>(values.data(), static_cast<std::size_t>(values.size()))};
}

images::Image image_of(const py::array& pixels) {
  if (pixels.ndim() < 2 || pixels.ndim() > 3 || pixels.size() == 0)
    throw InputError("image must have the shape (rows, columns) or (rows, columns, channels)");
  const std::string type = py::str(pixels.dtype()).cast<std::string>();
  if (type == "uint8") return image_with<std::uint8_t>(pixels);
  if (type == "bool") return image_with<std::uint8_t>(pixels);
  if (type == "int8") return image_with<std::int8_t>(pixels);
  if (type == "uint16") return image_with<std::uint16_t>(pixels);
  if (type == "int16") return image_with<std::int16_t>(pixels);
  if (type == "uint32") return image_with<std::uint32_t>(pixels);
  if (type == "int32") return image_with<std::int32_t>(pixels);
  if (type == "float32") return image_with<float>(pixels);
  if (type == "float64") return image_with<double>(pixels);
  throw py::type_error(fmt::format("image is an array of {}; integers of up to 32 bits, float32 or float64 are needed",
                                   type));
}

template <class Value>
py::array pixels_with(const images::Image& image) {
  std::vector<py::ssize_t> shape{image.height(), image.width()};
  if (image.channels() > 1) shape.push_back(image.channels());
  const std::span<const Value> values = image.values<Value>();
  return py::array_t<Value>(shape, values.data());
}

py::array pixels_of(const images::Image& image) {
  switch (image.type()) {
    case NumberType::kUint8:
      return pixels_with<std::uint8_t>(image);
    case NumberType::kInt8:
      return pixels_with<std::int8_t>(image);
    case NumberType::kUint16:
      return pixels_with<std::uint16_t>(image);
    case NumberType::kInt16:
      return pixels_with<std::int16_t>(image);
    case NumberType::kUint32:
      return pixels_with<std::uint32_t>(image);
    case NumberType::kInt32:
      return pixels_with<std::int32_t>(image);
    case NumberType::kFloat32:
      return pixels_with<float>(image);
    case NumberType::kFloat64:
      return pixels_with<double>(image);
    default:
      throw InputError("the image has numbers of a type that arrays are not made of");
  }
}

struct WarpedPicture {
  images::Image image;
  images::MapFigures figures;
  std::vector<float> displacements;
  bool pulled = false;
  std::string reason;
  double landmark_error = 0;
};

py::dict warp_image(const std::shared_ptr<Match>& match, const py::object& image,
                    const std::vector<std::string>& words, py::object progress) {
  Said said;
  const bool is_path = py::isinstance<py::str>(image);
  Picture picture;
  const std::string path = is_path ? image.cast<std::string>() : std::string("image");
  if (!is_path) {
    images::Image pixels = image_of(py::array::ensure(image));
    picture.pages.push_back({std::move(pixels), {}});
    picture.image = picture.pages.front().image;
  }
  const auto warped = in_host<WarpedPicture>(
      [&] {
        WarpArguments arguments;
        CLI::App options;
        arguments.add_to(options);
        std::vector<std::string> all = words;
        all.insert(all.end(), {"--out=warped.png", "registration", path});
        parse_hosted(options, all);
        arguments.input = path;
        if (is_path) picture = read_picture(path, arguments.max_pixels);
        const Registration& registration = match->registration();
        const warp::MaterialFlow& flow = match->flow(arguments.labels);
        if (!flow.is_diffeomorphic()) arguments.check_for_fold();
        const WarpFrames frames = warp_frames(arguments, registration, flow, picture);
        const images::ImageWarp warp =
            arguments.inverse ? images::ImageWarp(flow, registration.alignment, frames.result, frames.input)
                              : images::ImageWarp(flow, registration.alignment, frames.input, frames.result);
        images::WarpedImage result =
            images::warp_image(pages_of(picture), warp, warp_options(arguments, frames, picture.pages.front()));
        print_notes(frames.notes);
        for (const std::string& text : frames.warnings) print_warning(text);
        if (result.figures.uncovered_fraction > 0.9)
          print_warning(fmt::format("{:.3g} % of the result shows nothing of {}: see --pixel-size, --origin and --flip-y",
                                    100 * result.figures.uncovered_fraction, path));
        return WarpedPicture{std::move(result.image), result.figures, std::move(result.displacements), result.pulled,
                             result.reason, warp.landmark_error()};
      },
      {std::move(progress), true, &said});
  py::dict result;
  result["image"] = pixels_of(warped.image);
  result["method"] = warped.pulled ? "pull" : "push";
  result["reason"] = warped.reason;
  result["folded_fraction"] = warped.figures.folded_fraction;
  result["min_jacobian"] = warped.figures.min_jacobian;
  result["max_multiplicity"] = warped.figures.max_multiplicity;
  result["uncovered_fraction"] = warped.figures.uncovered_fraction;
  result["landmark_error_max"] = warped.landmark_error;
  result["warnings"] = said.warnings;
  result["notes"] = said.notes;
  return result;
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
  shot->path = make_integrator(integrator)->integrate(system, start, grid, dw);
  return shot;
}

}  // namespace

void add_registrations(py::module_& module) {
  py::class_<Shot, std::shared_ptr<Shot>>(module, "Trajectory", "A path of landmarks: q and p, (steps + 1, N, d).")
      .def_property_readonly("q", [](const Shot& self) { return states_of(self.path, [](const PhaseState& s) -> const Points& { return s.q; }); })
      .def_property_readonly("p", [](const Shot& self) { return states_of(self.path, [](const PhaseState& s) -> const Points& { return s.p; }); })
      .def_property_readonly("end", [](const py::object& self) { return view_of(self.cast<Shot&>().path.states.back().q, self); })
      .def_property_readonly("end_momenta", [](const py::object& self) { return view_of(self.cast<Shot&>().path.states.back().p, self); })
      .def_property_readonly("times", [](const Shot& self) { return times_of(self.path.grid, self.path.states.size()); })
      .def_property_readonly("increments", [](const py::object& self) { return view_of(self.cast<Shot&>().path.increments, self); })
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
      .def_property_readonly("source", [](const py::object& self) { return view_of(self.cast<Match&>().registration().source.points, self); })
      .def_property_readonly("target", [](const py::object& self) { return view_of(self.cast<Match&>().registration().target.points, self); })
      .def_property_readonly("original", [](const py::object& self) { return view_of(self.cast<Match&>().registration().original.points, self); })
      .def_property_readonly("distances", [](const Match& self) { return array_of(self.registration().distances()); })
      .def_property_readonly("record_text", &Match::record)
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
  module.def("_warp_points", &warp_points);
  module.def("_warp_shape", &warp_shape);
  module.def("_warp_image", &warp_image);
  module.def("_shoot", &shoot);
  module.attr("_path_kernel") = matching::path_defaults().kernel.value;
  module.attr("_path_integrator") = matching::path_defaults().integrator.value;
}

}  // namespace pulson::python
