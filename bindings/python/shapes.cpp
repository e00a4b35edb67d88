// Shapes of landmarks, read and written.

#include <optional>
#include <sstream>

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "arrays.hpp"
#include "core/atomic_file.hpp"
#include "core/landmark_pairs.hpp"
#include "pulson/core/alignment.hpp"
#include "pulson/core/errors.hpp"
#include "runs.hpp"
#include "shell/cohort_shapes.hpp"
#include "shell/messages.hpp"
#include "shell/options.hpp"
#include "shell/tables.hpp"

namespace pulson::python {
namespace {

Landmarks make_shape(const py::handle& points, const std::vector<std::string>& labels, const std::string& name,
                     const std::vector<std::string>& groups, const std::optional<bool>& y_up) {
  formats::LandmarkFile file = landmarks_of(points, "points");
  if (file.shapes.size() != 1)
    throw InputError(fmt::format("points has {} shapes; a Shape is one, (N, d)", file.shapes.size()));
  Landmarks shape = std::move(file.shapes.front());
  for (const auto& [what, list] : {std::pair("labels", &labels), std::pair("groups", &groups)})
    if (!list->empty() && std::ssize(*list) != shape.count())
      throw InputError(fmt::format("{} has {} entries for {} landmarks", what, list->size(), shape.count()));
  shape.labels = labels;
  shape.groups = groups;
  if (!name.empty()) shape.name = name;
  if (y_up) {
    shape.frame.y_down = !*y_up;
    shape.frame.says_y = true;
  }
  return shape;
}

py::list arrays_of(const std::vector<Points>& lines) {
  py::list arrays;
  for (const Points& line : lines) arrays.append(array_of(Points(line)));
  return arrays;
}

std::vector<Points> lines_of(const py::handle& arrays) {
  std::vector<Points> lines;
  for (const py::handle& array : arrays) lines.push_back(points_of(array, "a line"));
  return lines;
}

// What pickling keeps: all of it.
py::tuple state_of(const Landmarks& shape) {
  const Frame& frame = shape.frame;
  return py::make_tuple(
      arrays_of({shape.points}), arrays_of(shape.curves), arrays_of(shape.outlines),
      py::make_tuple(shape.labels, shape.groups, shape.name, shape.image, shape.scale, shape.properties, shape.links,
                     shape.numbers, shape.absent, shape.units, shape.axes, shape.source),
      py::make_tuple(frame.origin, frame.unit_per_pixel, frame.y_down, frame.height, frame.width, frame.says_y,
                     frame.says_units, static_cast<int>(frame.orientation)));
}

template <class... Members>
void take_all(const py::tuple& values, Members&... members) {
  std::size_t i = 0;
  ((members = values[i++].cast<Members>()), ...);
}

Landmarks shape_of(const py::tuple& state) {
  Landmarks shape;
  shape.points = lines_of(state[0]).at(0);
  shape.curves = lines_of(state[1]);
  shape.outlines = lines_of(state[2]);
  take_all(state[3], shape.labels, shape.groups, shape.name, shape.image, shape.scale, shape.properties, shape.links,
           shape.numbers, shape.absent, shape.units, shape.axes, shape.source);
  int orientation = 0;
  Frame& frame = shape.frame;
  take_all(state[4], frame.origin, frame.unit_per_pixel, frame.y_down, frame.height, frame.width, frame.says_y,
           frame.says_units, orientation);
  frame.orientation = static_cast<Orientation>(orientation);
  return shape;
}

struct ReadArguments {
  formats::ReadOptions reading;
  void add_to(CLI::App& options) {
    add_read_options(options, reading);
    add_flip_option(options, reading);
  }
};

// Shapes of a file by the options of reading, which are words of the command line. @return shapes and notes
std::pair<std::vector<Landmarks>, std::vector<std::string>> read(const std::string& address,
                                                                 const std::vector<std::string>& words) {
  return in_host<std::pair<std::vector<Landmarks>, std::vector<std::string>>>([&] {
    const auto arguments = hosted_arguments<ReadArguments>(words);
    formats::LandmarkFile file = formats::read_addressed_shapes(address, arguments.reading);
    return std::pair(std::move(file.shapes), std::move(file.warnings));
  });
}

std::vector<std::string> write(const std::string& path, const std::vector<Landmarks>& shapes,
                               const std::string& format_name) {
  const formats::LandmarkFormat& format = formats::landmark_format_to_write(path, format_name);
  check_output_file(path);
  formats::LandmarkFile file;
  file.shapes = shapes;
  for (const Landmarks& shape : shapes) {
    if (file.axes.empty()) file.axes = shape.axes;
    if (file.units.empty()) file.units = shape.units;
    if (shape.axes != file.axes || shape.units != file.units)
      throw InputError(fmt::format("{}: shapes of other axes or units than the first: {}", path, shape.name));
  }
  std::vector<std::string> notes;
  prepare_to_write(format, file, notes);
  const formats::WrittenLandmarks written = text_to_write(path, file, format);
  write_file_atomically(path, written.text);
  notes.insert(notes.end(), written.losses.begin(), written.losses.end());
  return notes;
}

struct Aligned {
  Alignment map;
  Points points;
};

AlignmentKind kind_of(const std::string& name, Eigen::Index dimension) {
  if (name == "auto") return dimension == 1 ? AlignmentKind::kNone : AlignmentKind::kSimilarity;
  return parse_alignment(name);
}

Aligned align_pair(const py::handle& source, const py::handle& target, const std::string& kind, bool reflect,
                   const std::optional<Doubles>& weights) {
  Points x = points_of(source, "source");
  const Points y = points_of(target, "target");
  if (x.rows() != y.rows() || x.cols() != y.cols())
    throw InputError(
        fmt::format("source has {} landmarks in {}D, target {} in {}D", x.cols(), x.rows(), y.cols(), y.rows()));
  AlignmentOptions options{.weights = {}, .reflect = reflect};
  if (weights) options.weights = Eigen::Map<const Eigen::VectorXd>(weights->data(), weights->size());
  Alignment map = pulson::align(x, y, kind_of(kind, x.rows()), options);
  return {map, map.apply(x)};
}

std::string text_of(const Landmarks& shape) {
  return fmt::format("<Shape {}: {} landmarks in {}D>", quoted_line(shape.name), shape.count(), shape.dimension());
}

}  // namespace

void add_shapes(py::module_& module) {
  py::class_<Landmarks, std::shared_ptr<Landmarks>>(module, "Shape",
                                                    R"(One shape: landmarks with what a file says of them.

>>> import pulson
>>> shape = pulson.Shape([[0, 0], [1, 0], [0, 1]], labels=["a", "b", "c"], name="triangle")
>>> shape
<Shape 'triangle': 3 landmarks in 2D>
>>> shape.points.shape, shape.labels
((3, 2), ['a', 'b', 'c'])
)")
      .def(py::init(&make_shape), py::arg("points"), py::arg("labels") = std::vector<std::string>(),
           py::arg("name") = "", py::arg("groups") = std::vector<std::string>(), py::arg("y_up") = py::none())
      .def_property_readonly(
          "points", [](const py::object& self) { return view_of(self.cast<const Landmarks&>().points, self); },
          "coordinates, (N, d); a missing one is nan")
      .def("__array__",
           [](const py::object& self, const py::args&, const py::kwargs& options) {
             const py::object view = view_of(self.cast<const Landmarks&>().points, self);
             const bool has_type = options.contains("dtype") && !options["dtype"].is_none();
             return has_type ? view.attr("astype")(options["dtype"]) : view;
           })
      .def_readonly("labels", &Landmarks::labels, "names of the landmarks, or empty")
      .def_readonly("groups", &Landmarks::groups, "the outline of each landmark, or empty")
      .def_readwrite("name", &Landmarks::name, "of the specimen")
      .def_readonly("image", &Landmarks::image, "the picture that it was digitised on")
      .def_readonly("scale", &Landmarks::scale, "length units per unit of the coordinates, or None")
      .def_readonly("units", &Landmarks::units)
      .def_readonly("axes", &Landmarks::axes)
      .def_readonly("absent", &Landmarks::absent, "landmarks that the specimen does not have, from 0")
      .def_readonly("links", &Landmarks::links)
      .def_readonly("source", &Landmarks::source, "where it came from")
      .def_property_readonly(
          "y_up",
          [](const Landmarks& shape) {
            return shape.dimension() == 2 && shape.frame.says_y ? std::optional(!shape.frame.y_down) : std::nullopt;
          },
          "whether y points upwards on its picture, or None where nothing says so: then pixels are counted downwards")
      .def_property_readonly("diameter", [](const Landmarks& shape) { return diameter(shape.points); })
      .def_property_readonly("centroid_size", [](const Landmarks& shape) { return centroid_size(shape.points); })
      .def("__len__", &Landmarks::count)
      .def(py::pickle(&state_of, &shape_of))
      .def("__repr__", &text_of);

  py::class_<Aligned>(module, "Alignment",
                      "The map x -> scale * linear @ x + translation, and where it takes the source.")
      .def_property_readonly("points",
                             [](const py::object& self) { return view_of(self.cast<Aligned&>().points, self); })
      .def_property_readonly("scale", [](const Aligned& self) { return self.map.scale; })
      .def_property_readonly("linear",
                             [](const Aligned& self) { return array_of(Eigen::MatrixXd(self.map.linear.transpose())); })
      .def_property_readonly("translation", [](const Aligned& self) { return array_of(self.map.translation); })
      .def_property_readonly("kind", [](const Aligned& self) { return alignment_name(self.map.kind); })
      .def("__repr__",
           [](const Aligned& self) {
             return fmt::format("<Alignment: {}, scale {:.4g}, {} landmarks in {}D>", alignment_name(self.map.kind),
                                self.map.scale, self.points.cols(), self.points.rows());
           })
      .def("apply", [](const Aligned& self, const py::handle& points) {
        const Points x = points_of(points, "points");
        if (x.rows() != self.points.rows())
          throw InputError(fmt::format("points are in {}D, the alignment in {}D", x.rows(), self.points.rows()));
        return array_of(self.map.apply(x));
      });

  module.def("_read", &read);
  module.def("_write", &write);
  module.def("_align", &align_pair);
  module.def("_procrustes_mean", [](const std::vector<Landmarks>& shapes, const std::string& kind) {
    if (shapes.empty()) throw InputError("there are no shapes");
    return procrustes_mean(shapes, kind_of(kind, shapes.front().dimension()));
  });
  module.def("_shapes_of",
             [](const py::handle& value, const std::string& what) { return landmarks_of(value, what).shapes; });
}

}  // namespace pulson::python
