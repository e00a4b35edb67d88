#include "arrays.hpp"

#include <array>
#include <cctype>
#include <cmath>
#include <cstring>
#include <span>

#include <fmt/format.h>

#include "formats/formats.hpp"
#include "pulson/core/errors.hpp"
#include "shell/options.hpp"

namespace pulson::python {
namespace {

std::string shape_text(const py::array& array) {
  std::string text = "(";
  for (py::ssize_t i = 0; i < array.ndim(); ++i) text += (i > 0 ? ", " : "") + std::to_string(array.shape(i));
  return text + (array.ndim() == 1 ? ",)" : ")");
}

[[noreturn]] void refuse_shape(const py::array& array, const std::string& what) {
  const py::ssize_t n = array.ndim();
  const bool is_turned = n >= 2 && array.shape(n - 2) <= 3 && array.shape(n - 1) > 3;
  throw InputError(fmt::format("{} has the shape {}; landmarks are rows of 1, 2 or 3 coordinates, (N, d){}", what,
                               shape_text(array), is_turned ? "; transpose it" : ""));
}

}  // namespace

Doubles doubles_of(const py::handle& given, const std::string& what) {
  py::object value = py::reinterpret_borrow<py::object>(given);
  if (py::isinstance<py::array>(value) && py::hasattr(value, "filled"))  // a masked array: what is masked is missing
    value = value.attr("astype")("f8").attr("filled")(std::nan(""));
  const py::array array = py::array::ensure(value);
  if (!array) {
    PyErr_Clear();
    throw py::type_error(fmt::format("{} is no array of numbers", what));
  }
  const char kind = array.dtype().kind();
  if (kind != 'f' && kind != 'i' && kind != 'u' && kind != 'b')
    throw py::type_error(
        fmt::format("{} is an array of {}; numbers are needed", what, py::str(array.dtype()).cast<std::string>()));
  Doubles doubles = Doubles::ensure(array);
  if (!doubles) throw py::error_already_set();
  return doubles;
}

py::array view_of(const Eigen::MatrixXd& matrix, const py::handle& owner) {
  py::array array(py::dtype::of<double>(), std::vector<py::ssize_t>{matrix.cols(), matrix.rows()}, matrix.data(),
                  owner);
  py::detail::array_proxy(array.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  return array;
}

py::array array_of(Eigen::MatrixXd matrix) {
  auto kept = std::make_unique<Eigen::MatrixXd>(std::move(matrix));
  Eigen::MatrixXd* const raw = kept.get();
  const py::capsule owner(raw, [](void* pointer) { delete static_cast<Eigen::MatrixXd*>(pointer); });
  static_cast<void>(kept.release());  // the capsule owns it
  return {py::dtype::of<double>(), std::vector<py::ssize_t>{raw->cols(), raw->rows()}, raw->data(), owner};
}

py::array array_of(const Eigen::VectorXd& numbers) { return py::array_t<double>(numbers.size(), numbers.data()); }

py::array stack_of(const std::vector<Eigen::MatrixXd>& matrices) {
  if (matrices.empty()) return py::array_t<double>(std::vector<py::ssize_t>{0, 0, 0});
  const Eigen::MatrixXd& first = matrices.front();
  py::array_t<double> stack(
      std::vector<py::ssize_t>{static_cast<py::ssize_t>(matrices.size()), first.cols(), first.rows()});
  double* to = stack.mutable_data();
  for (const Eigen::MatrixXd& matrix : matrices) to = std::copy(matrix.data(), matrix.data() + matrix.size(), to);
  return stack;
}

Points points_of(const py::handle& value, const std::string& what) {
  const Doubles doubles = doubles_of(value, what);
  if (doubles.ndim() != 1 && (doubles.ndim() != 2 || doubles.shape(1) < 1 || doubles.shape(1) > 3))
    refuse_shape(doubles, what);
  return Eigen::Map<const Points>(doubles.data(), doubles.ndim() == 1 ? 1 : doubles.shape(1), doubles.shape(0));
}

formats::LandmarkFile landmarks_of(const py::handle& value, const std::string& what) {
  const Doubles doubles = doubles_of(value, what);
  const py::ssize_t n = doubles.ndim();
  if (n < 1 || n > 3 || (n > 1 && (doubles.shape(n - 1) < 1 || doubles.shape(n - 1) > 3))) refuse_shape(doubles, what);
  if (doubles.size() == 0)
    throw InputError(fmt::format("{} has the shape {}: no landmarks", what, shape_text(doubles)));
  std::vector<std::size_t> sizes(doubles.shape(), doubles.shape() + n);
  if (n == 1) sizes.push_back(1);
  const std::string bytes = formats::npy_bytes({doubles.data(), static_cast<std::size_t>(doubles.size())}, sizes);
  return formats::shapes_of_text(what, bytes, {.format = "npy"});
}

std::string in_python_words(const std::string& message) {
  const std::string text = in_option_words(message);
  std::string result;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool begins = text.compare(i, 2, "--") == 0 && i + 2 < text.size() &&
                        std::isalpha(static_cast<unsigned char>(text[i + 2])) != 0 && (i == 0 || text[i - 1] != '-');
    if (!begins) {
      result += text[i];
      continue;
    }
    std::string name;
    for (i += 2; i < text.size() && (std::isalnum(static_cast<unsigned char>(text[i])) != 0 || text[i] == '-'); ++i)
      name += text[i] == '-' ? '_' : text[i];
    result += name;
    if (name == "lambda" || name == "from") result += '_';  // words of Python
    --i;
  }
  return result;
}

}  // namespace pulson::python
