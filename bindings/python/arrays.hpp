#pragma once

#include <memory>
#include <string>
#include <utility>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "pulson/core/landmarks.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::python {

namespace py = pybind11;

/// Doubles in C order, of any array of numbers: without a copy where it is of that kind.
using Doubles = py::array_t<double, py::array::c_style | py::array::forcecast>;

/// An array of numbers. @param what messages call it @throws py::type_error where it is none
Doubles doubles_of(const py::handle& value, const std::string& what);

/// A matrix d×N as (N, d), both in the memory of `owner`, read-only.
py::array view_of(const Eigen::MatrixXd& matrix, const py::handle& owner);

/// A matrix d×N as (N, d), which has its memory.
py::array array_of(Eigen::MatrixXd matrix);
/// N numbers.
py::array array_of(const Eigen::VectorXd& numbers);
/// Matrices d×N as (K, N, d).
py::array stack_of(const std::vector<Eigen::MatrixXd>& matrices);

/// Points d×N of (N, d), or of (N,) on a line. @param what messages call them @throws InputError
Points points_of(const py::handle& value, const std::string& what);

/// Landmarks of (N, d), (N,) or (S, N, d) as readers take them from a .npy file. @throws InputError
formats::LandmarkFile landmarks_of(const py::handle& value, const std::string& what);

/// A message in the words of Python: options as keyword arguments.
std::string in_python_words(const std::string& message);

void add_shapes(py::module_& module);
void add_runs(py::module_& module);
void add_registrations(py::module_& module);
void add_kernels(py::module_& module);
void add_noise_models(py::module_& module);

}  // namespace pulson::python
