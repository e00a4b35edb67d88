#pragma once

#include <memory>
#include <type_traits>

#include "arrays.hpp"
#include "pulson/dynamics/noise_model.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson::python {

/// A Kernel, or a specification. @throws InputError
KernelOperator kernel_of(const py::handle& value, const Points& q);

/// The objects of Python whose kernels these are: whoever keeps them keeps the kernel usable.
py::list own_kernels_of(const KernelOperator& kernel);

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

/// Where a computation is to end, between calls of a user's function. @throws what ends it
void look_for_stop();

/// That the garbage collector sees functions that objects of a class hold, through members of it: visit(self, see)
/// calls see(function) for those that nothing but the object holds, clear(self) lets go of them. Functions often know
/// the names around the object that holds them.
template <class Held, class Visit, class Clear>
py::custom_type_setup collected(Visit, Clear) {
  static_assert(std::is_empty_v<Visit> && std::is_empty_v<Clear>);
  return py::custom_type_setup([](PyHeapTypeObject* heap_type) {
    const auto held_by = [](PyObject* object) -> Held* {
      const auto held = reinterpret_cast<py::detail::instance*>(object)->get_value_and_holder();
      return held.holder_constructed() ? py::cast<Held*>(py::handle(object)) : nullptr;
    };
    static const auto of = held_by;
    PyTypeObject& type = heap_type->ht_type;
    type.tp_flags |= Py_TPFLAGS_HAVE_GC;
    type.tp_traverse = [](PyObject* object, visitproc visit, void* arg) {
      Py_VISIT(Py_TYPE(object));
      int stop = 0;
      if (const Held* held = of(object))
        Visit{}(*held, [&](const py::object& function) {
          if (stop == 0 && function) stop = visit(function.ptr(), arg);
        });
      return stop;
    };
    type.tp_clear = [](PyObject* object) {
      if (Held* held = of(object)) Clear{}(*held);
      return 0;
    };
  });
}

/// f'(0) of f(−2t), f(−t), f(t), f(2t), to fourth order.
template <class Value>
Value slope_of(const Value& minus2, const Value& minus1, const Value& plus1, const Value& plus2, double t) {
  return ((minus2 - plus2) + 8 * (plus1 - minus1)) / (12 * t);
}

}  // namespace pulson::python
