#pragma once

#include <memory>

#include "arrays.hpp"
#include "pulson/dynamics/noise_model.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::python {

/// A Kernel, or a specification. @throws InputError
KernelOperator kernel_of(const py::handle& value, const Points& q);

/// An own noise, or a specification; None is none. @throws InputError
std::shared_ptr<const NoiseModel> noise_of(const py::handle& value, const Points& q);

/// Whether this thread is in a function of Python that a computation called.
bool is_in_callback();

}  // namespace pulson::python
