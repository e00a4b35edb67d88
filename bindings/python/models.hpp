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

/// The interpreter's lock, for a function of Python that a computation calls in any thread.
class Callback {
 public:
  Callback();
  ~Callback();
  Callback(const Callback&) = delete;
  Callback& operator=(const Callback&) = delete;

 private:
  py::gil_scoped_acquire lock_;
};

/// Whether this thread is in such a function.
bool is_in_callback();

/// Where a host wants a computation to end, between calls. @throws HostStopped
void look_for_stop();

/// f'(0) of f(−2t), f(−t), f(t), f(2t), to fourth order.
template <class Value>
Value slope_of(const Value& minus2, const Value& minus1, const Value& plus1, const Value& plus2, double t) {
  return ((minus2 - plus2) + 8 * (plus1 - minus1)) / (12 * t);
}

}  // namespace pulson::python
