// Points and pictures moved by the map of a registration.

#include <cmath>
#include <memory>
#include <span>

#include <Eigen/LU>
#include <fmt/format.h>
#include <pybind11/stl.h>

#include "match.hpp"
#include "pulson/core/errors.hpp"
#include "runs.hpp"
#include "warp/frames.hpp"
#include "warp/jobs.hpp"
#include "warp/points_frame.hpp"

namespace pulson::python {
namespace {

using matching::Registration;

// NaN stays where a point misses a coordinate.
Points known_columns(const Points& points, std::vector<Eigen::Index>& known) {
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    if (!points.col(i).hasNaN()) known.push_back(i);
  return points(Eigen::all, known);
}

// As `warp` moves points that are in the coordinates of the registration's source, or with `inverse` of its target. The
// determinants are those of the map from source to target, alignment included.
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
  } else if (with_gradients) {
    to = flow.end_with_gradients(alignment.apply(from));
  } else {
    to.places = flow.end(alignment.apply(from));
  }
  if (!to.places.allFinite()) throw NumericalError("points: one is moved out of the range of numbers");
  Points result = Points::Constant(points.rows(), points.cols(), std::nan(""));
  result(Eigen::all, known) = to.places;
  if (with_gradients) {
    jacobians = Eigen::VectorXd::Constant(points.cols(), std::nan(""));
    const double aligned = std::pow(alignment.scale, flow.dimension()) * std::abs(alignment.linear.determinant());
    if (!known.empty()) {
      const Eigen::ArrayXd of_flow = to.jacobians();
      jacobians(known) = aligned * (inverse ? Eigen::ArrayXd(of_flow.inverse()) : of_flow).matrix();
    }
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
  const char kind = pixels.dtype().kind();
  const auto bytes = pixels.dtype().itemsize();
  if (kind == 'b' || (kind == 'u' && bytes == 1)) return image_with<std::uint8_t>(pixels);
  if (kind == 'u' && bytes == 2) return image_with<std::uint16_t>(pixels);
  if (kind == 'u' && bytes == 4) return image_with<std::uint32_t>(pixels);
  if (kind == 'i' && bytes == 1) return image_with<std::int8_t>(pixels);
  if (kind == 'i' && bytes == 2) return image_with<std::int16_t>(pixels);
  if (kind == 'i' && bytes == 4) return image_with<std::int32_t>(pixels);
  if (kind == 'f' && bytes <= 4) return image_with<float>(pixels);
  if (kind == 'f' && bytes == 8) return image_with<double>(pixels);
  throw py::type_error(fmt::format("image is an array of {}; integers of up to 32 bits, float32 or float64 are needed",
                                   py::str(pixels.dtype()).cast<std::string>()));
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

py::dict warp_image(const std::shared_ptr<Match>& match, const py::object& image, const std::vector<std::string>& words,
                    py::object progress) {
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
        std::vector<std::string> all = words;
        all.insert(all.end(), {"--out=warped.png", "registration", path});
        auto arguments = hosted_arguments<WarpArguments>(all);
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
          print_warning(
              fmt::format("{:.3g} % of the result shows nothing of {}: see --pixel-size, --origin and --flip-y",
                          100 * result.figures.uncovered_fraction, path));
        return WarpedPicture{std::move(result.image), result.figures, std::move(result.displacements),
                             result.pulled,           result.reason,  warp.landmark_error()};
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

}  // namespace

void add_warps(py::module_& module) {
  module.def("_warp_points", &warp_points);
  module.def("_warp_shape", &warp_shape);
  module.def("_warp_image", &warp_image);
}

}  // namespace pulson::python
