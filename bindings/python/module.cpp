// The Python module pulson._pulson; bindings/python/pulson is what its users see.

#include <exception>

#include "arrays.hpp"
#include "core/blas_memory.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/version.hpp"
#include "shell/host.hpp"

namespace {

namespace py = pybind11;

void translate(std::exception_ptr failure) {
  if (!failure) return;
  try {
    std::rethrow_exception(failure);
  } catch (const pulson::NumericalError& error) {
    PyErr_SetString(PyExc_ArithmeticError, pulson::python::in_python_words(error.what()).c_str());
  } catch (const pulson::Error& error) {
    const std::string text = pulson::python::in_python_words(error.what());
    const bool is_missing = text.find("No such file or directory") != std::string::npos;
    PyErr_SetString(is_missing ? PyExc_FileNotFoundError : PyExc_ValueError, text.c_str());
  } catch (const pulson::HostStopped&) {  // what went on beside it was interrupted
    PyErr_SetNone(PyExc_KeyboardInterrupt);
  }
}

}  // namespace

PYBIND11_MODULE(_pulson, module) {
  py::register_exception_translator(&translate);
  pulson::python::add_shapes(module);
  pulson::python::add_kernels(module);
  pulson::python::add_noise_models(module);
  pulson::python::add_runs(module);
  pulson::python::add_registrations(module);
  module.attr("__version__") = pulson::version();
}
