// Kernels, by their specification or written in Python.

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>
#include <pybind11/stl.h>

#include "core/step_watch.hpp"
#include "models.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/kernels/own_kernel.hpp"

namespace pulson::python {
namespace {

using Eigen::ArrayXd;
using Eigen::Index;

thread_local int callbacks = 0;

// Of differences of fourth order in r/α: for a Gaussian k' and k'' have errors of 5e-11, and a kernel that ends at
// r = α is smooth but for a thousandth of its width.
constexpr double kRadialStep = 2e-3;

// Of a kernel that is a smooth function of r² differences are even in r, and nearer than this constant to 1e-8.
constexpr double kNearest = 1e-4;
// Where the third derivative by r jumps at 0, as Matérn's, differences keep to one side.
constexpr double kNearestToKink = 1e-8;

struct OwnKernel;

/// A profile whose k(s), s = r²/α², and as many of its derivatives by s as its author has, are functions in Python.
class PythonProfile final : public OwnProfile {
 public:
  PythonProfile(py::object k, py::object first, py::object second, std::string name)
      : k_(std::move(k)), first_(std::move(first)), second_(std::move(second)), name_(std::move(name)) {
    if (first_.is_none() && !second_.is_none())
      throw InputError(fmt::format("kernel '{}': second is given without first", name_));
    check_value();
    is_smooth_ = is_smooth();
    check_derivatives();
    check_definite();
    const ArrayXd r = ArrayXd::LinSpaced(4000, 5e-3, 20);
    lipschitz_ = 1.01 * (2 * r * at(r.square(), 1).first).abs().maxCoeff();  // between two of these r it may be more
  }

  ~PythonProfile() override {
    const py::gil_scoped_acquire lock;
    k_ = first_ = second_ = py::object();
  }
  PythonProfile(const PythonProfile&) = delete;
  PythonProfile& operator=(const PythonProfile&) = delete;

  ProfileValues at(const ArrayXd& s, int order) const override {
    look_for_stop();
    // What is no number, or beyond all, reaches no function of the user's.
    const auto is_known = s.isFinite();
    const ArrayXd known = is_known.select(s, 1);
    ProfileValues values;
    values.value = call(k_, known, "k");
    if (order > 0) {
      const double nearest = is_smooth_ ? kNearest : kNearestToKink;
      const ArrayXd r = known.sqrt().max(nearest);
      values.first = first_.is_none() ? slope_in_s(r, k_, "k") : call(first_, r.square(), "first");
      if (order > 1) values.second = second(r, values.first);
    }
    for (ArrayXd* numbers : {&values.value, &values.first, &values.second})
      if (numbers->size() > 0) *numbers = is_known.select(*numbers, s.isNaN().select(s, 0));
    return values;
  }

  double lipschitz() const override { return lipschitz_; }

  std::weak_ptr<OwnKernel> owner{};

  template <class See>
  void show_functions(const See& see) const {
    for (const py::object* function : {&k_, &first_, &second_}) see(*function);
  }

 private:
  ArrayXd call(const py::object& function, const ArrayXd& s, const char* what) const {
    const Callback python;
    const Doubles values =
        doubles_of(function(array_of(Eigen::VectorXd(s.matrix()))), fmt::format("what {} returns", what));
    if (values.ndim() != 1 || values.size() != s.size())
      throw InputError(
          fmt::format("kernel '{}': {} must return an array of the shape of s, ({},)", name_, what, s.size()));
    ArrayXd result = Eigen::Map<const ArrayXd>(values.data(), values.size());
    Index where = 0;
    if (!result.isFinite().all()) {
      result.isFinite().minCoeff(&where);
      throw InputError(fmt::format("kernel '{}': {} returns {} at s = {}", name_, what, result[where], s[where]));
    }
    return result;
  }

  // Values at r + t·(−2, −1, 1, 2), of an even function of r, by one call.
  std::array<ArrayXd, 4> around(const ArrayXd& r, const ArrayXd& t, const py::object& function,
                                const char* what) const {
    const Index n = r.size();
    ArrayXd all(4 * n);
    all << (r - 2 * t).square(), (r - t).square(), (r + t).square(), (r + 2 * t).square();
    const ArrayXd values = call(function, all, what);
    return {values.head(n), values.segment(n, n), values.segment(2 * n, n), values.tail(n)};
  }

  ArrayXd steps(const ArrayXd& r) const {
    return is_smooth_ ? ArrayXd::Constant(r.size(), kRadialStep) : ArrayXd((r / 4).min(kRadialStep));
  }

  // df/ds = f'(r)/2r
  ArrayXd slope_in_s(const ArrayXd& r, const py::object& function, const char* what) const {
    const ArrayXd t = steps(r);
    const auto [a, b, c, d] = around(r, t, function, what);
    return ((a - d) + 8 * (c - b)) / (24 * t * r);
  }

  // k''(s): its own, else of k', else of k by (f'' − f'/r)/4r²
  ArrayXd second(const ArrayXd& r, const ArrayXd& first) const {
    if (!second_.is_none()) return call(second_, r.square(), "second");
    if (!first_.is_none()) return slope_in_s(r, first_, "first");
    const ArrayXd t = steps(r), here = call(k_, r.square(), "k");
    const auto [a, b, c, d] = around(r, t, k_, "k");
    const ArrayXd bend = (16 * (b + c) - (a + d) - 30 * here) / (12 * t.square());
    return (bend - 2 * first) / (4 * r.square());
  }

  void check_value() const {
    const double at_zero = call(k_, ArrayXd::Zero(1), "k")[0];
    if (std::abs(at_zero - 1) > 1e-9)
      throw InputError(
          fmt::format("kernel '{}': k(0) is {}; it must be 1, and weight= scales a kernel", name_, at_zero));
  }

  // Whether k is smooth as an even function of r: its second differences at 0 are the same with half the step.
  bool is_smooth() const {
    const auto bend = [&](double t) {
      const ArrayXd k = call(k_, (ArrayXd(2) << t * t, 4 * t * t).finished(), "k");
      return (32 * (k[0] - 1) - 2 * (k[1] - 1)) / (12 * t * t);
    };
    const double coarse = bend(8 * kRadialStep), fine = bend(4 * kRadialStep);
    return std::abs(coarse - fine) <= 1e-5 * std::abs(fine);
  }

  void require_same(const ArrayXd& own, const ArrayXd& differences, double tolerance, const char* what) const {
    const double scale = std::max(own.abs().maxCoeff(), differences.abs().maxCoeff());
    const double error = (own - differences).abs().maxCoeff();
    if (!(error <= tolerance * std::max(scale, 1e-8)))
      throw InputError(
          fmt::format("kernel '{}': {} differs from central differences by {:.2g} of its size; it must be "
                      "the derivative by s = r²/alpha²",
                      name_, what, error / scale));
  }

  void check_derivatives() const {
    const ArrayXd r = ArrayXd::LinSpaced(60, 0.05, 3);
    if (!first_.is_none()) require_same(call(first_, r.square(), "first"), slope_in_s(r, k_, "k"), 1e-5, "first");
    if (!second_.is_none())
      require_same(call(second_, r.square(), "second"), slope_in_s(r, first_, "first"), 1e-3, "second");
  }

  // Matrices of lattices in space are positive, from spacings at which landmarks are nearly one to such at which they
  // are alone: the spectrum of k is positive up to the frequencies of these.
  void check_definite() const {
    const SerialBlas serial;
    constexpr int kSide = 5;
    constexpr Index kCount = kSide * kSide * kSide;
    for (const double spacing : {0.25, 0.5, 1.0, 2.0}) {
      Points lattice(3, kCount);
      for (Index i = 0; i < kCount; ++i)
        lattice.col(i) << static_cast<double>(i % kSide), static_cast<double>(i / kSide % kSide),
            static_cast<double>(i / kSide / kSide);
      lattice *= spacing;
      ArrayXd s(kCount * kCount);
      for (Index j = 0; j < kCount; ++j)
        s.segment(j * kCount, kCount) = (lattice.colwise() - lattice.col(j)).colwise().squaredNorm();
      const Eigen::MatrixXd matrix = call(k_, s, "k").reshaped(kCount, kCount);
      const Eigen::VectorXd values =
          Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd>(matrix, Eigen::EigenvaluesOnly).eigenvalues();
      if (values[0] < -1e-10 * values[kCount - 1])
        throw InputError(
            fmt::format("kernel '{}' is not positive definite: its matrix of points {} alpha apart has the "
                        "eigenvalue {:.2g}",
                        name_, spacing, values[0]));
    }
  }

  py::object k_, first_, second_;
  std::string name_;
  bool is_smooth_ = false;
  double lipschitz_ = 0;
};

/// What Python holds: while one lives, specifications know its name.
struct OwnKernel {
  std::string name;
  std::shared_ptr<const PythonProfile> profile;
};

struct ShowFunctions {
  template <class See>
  void operator()(const OwnKernel& own, const See& see) const {
    if (own.profile.use_count() == 1) own.profile->show_functions(see);
  }
};
struct ForgetProfile {
  void operator()(OwnKernel& own) const { own.profile.reset(); }
};

std::shared_ptr<OwnKernel> make_own_kernel(const py::object& k, const py::object& first, const py::object& second,
                                           const std::optional<std::string>& given_name) {
  static int count = 0;
  const std::string name = given_name ? *given_name : fmt::format("own{}", ++count);
  const auto profile = std::make_shared<PythonProfile>(k, first, second, name);
  auto own = std::make_shared<OwnKernel>(OwnKernel{name, profile});
  profile->owner = own;
  name_kernel(name, profile);
  return own;
}

py::array gram_of(const KernelOperator& kernel, const py::handle& x, const py::handle& y) {
  const Points at = points_of(x, "x"), from = points_of(y, "y");
  if (at.rows() != from.rows()) throw InputError(fmt::format("x is in {}D, y in {}D", at.rows(), from.rows()));
  Eigen::MatrixXd matrix;
  {
    const py::gil_scoped_release others_run;
    matrix = kernel.gram(at, from).transpose();
  }
  const double missing = std::nan("");  // vector code takes it for far away
  for (Index i = 0; i < at.cols(); ++i)
    if (at.col(i).hasNaN()) matrix.col(i).setConstant(missing);
  for (Index j = 0; j < from.cols(); ++j)
    if (from.col(j).hasNaN()) matrix.row(j).setConstant(missing);
  return array_of(std::move(matrix));
}

py::array velocity_of(const KernelOperator& kernel, const py::handle& x, const py::handle& q, const py::handle& p) {
  const Points at = points_of(x, "x"), from = points_of(q, "q"), momenta = points_of(p, "p");
  if (from.rows() != momenta.rows() || from.cols() != momenta.cols() || at.rows() != from.rows())
    throw InputError("x, q and p must have the same number of coordinates, q and p as many landmarks");
  if (!from.allFinite() || !momenta.allFinite()) throw InputError("q and p must be finite");
  Points field;
  {
    const py::gil_scoped_release others_run;
    field = kernel.apply(at, from, momenta);
  }
  for (Index i = 0; i < at.cols(); ++i)
    if (at.col(i).hasNaN()) field.col(i).setConstant(std::nan(""));
  return array_of(std::move(field));
}

}  // namespace

Callback::Callback() { ++callbacks; }
Callback::~Callback() { --callbacks; }
bool is_in_callback() { return callbacks > 0; }

void look_for_stop() { StepWatch::before_step(); }

KernelOperator kernel_of(const py::handle& value, const Points& q) {
  if (py::isinstance<KernelOperator>(value)) return value.cast<KernelOperator>();
  if (py::isinstance<OwnKernel>(value) && !value.attr("is_current").cast<bool>())
    throw InputError(fmt::format("another kernel was made with the name '{}' of this one; give each a name of its own",
                                 value.attr("name").cast<std::string>()));
  return make_kernel(py::str(value).cast<std::string>(), q);
}

py::list own_kernels_of(const KernelOperator& kernel) {
  py::list kernels;
  for (const std::shared_ptr<const OwnProfile>& profile : own_profiles(kernel))
    if (const auto* of_python = dynamic_cast<const PythonProfile*>(profile.get()))
      if (const std::shared_ptr<OwnKernel> own = of_python->owner.lock()) kernels.append(py::cast(own));
  return kernels;
}

void add_kernels(py::module_& module) {
  py::class_<KernelOperator>(module, "Kernel", R"(A kernel, by its specification; `pulson info kernels` lists them.

>>> import pulson
>>> kernel = pulson.Kernel("gaussian:alpha=0.5")
>>> kernel.gram([[0, 0]], [[0, 0], [0.5, 0]]).round(4)
array([[1.    , 0.3679]])
)")
      .def(py::init([](const py::object& spec, const py::object& source) {
             return make_kernel(py::str(spec).cast<std::string>(),
                                source.is_none() ? Points() : points_of(source, "source"));
           }),
           py::arg("spec"), py::arg("source") = py::none())
      .def_property_readonly("spec", [](const KernelOperator& self) { return self.spec(); })
      .def("gram", &gram_of, "K(x_i - y_j), (M, N)", py::arg("x"), py::arg("y"))
      .def("velocity", &velocity_of, "sum_j K(x_i - q_j) p_j, (M, d)", py::arg("x"), py::arg("q"), py::arg("p"))
      .def("__str__", [](const KernelOperator& self) { return self.spec(); })
      .def(py::pickle([](const KernelOperator& self) { return py::make_tuple(self.spec()); },
                      [](const py::tuple& state) { return make_kernel(state[0].cast<std::string>(), {}); }))
      .def("__repr__", [](const KernelOperator& self) { return fmt::format("Kernel('{}')", self.spec(6)); });

  py::class_<OwnKernel, std::shared_ptr<OwnKernel>>(
      module, "OwnKernel", collected<OwnKernel>(ShowFunctions{}, ForgetProfile{}), R"(A kernel of one's own.

K = k(s) of s = r^2/alpha^2, with k(0) = 1. `k(s)` gets an array (M,) and returns one; `first(s)` and `second(s)` are
its derivatives by s. Those that are not given are central differences; those that are, are compared with them when
the object is made, and k is tested for being positive definite. While the object lives its name is one of a kernel,
for all functions: `NAME:alpha=0.4`, alone and in sums.

>>> import numpy as np, pulson
>>> rational = pulson.OwnKernel(lambda s: 1 / (1 + s), name="rational")
>>> pulson.Kernel("rational:alpha=2").gram([[0.0, 0.0]], [[0.0, 0.0], [2.0, 0.0]])
array([[1. , 0.5]])
)")
      .def(py::init(&make_own_kernel), py::arg("k"), py::arg("first") = py::none(), py::arg("second") = py::none(),
           py::kw_only(), py::arg("name") = py::none())
      .def_property_readonly("name", [](const OwnKernel& self) { return self.name; })
      .def_property_readonly(
          "is_current",
          [](const OwnKernel& self) {
            const KernelOperator named = make_kernel(self.name + ":alpha=1", {});
            return own_profiles(named) == std::vector<std::shared_ptr<const OwnProfile>>{self.profile};
          },
          "whether its name means it, and no kernel that was made later")
      .def("__str__", [](const OwnKernel& self) { return self.name; })
      .def("__repr__", [](const OwnKernel& self) { return fmt::format("<OwnKernel '{}'>", self.name); });
}

}  // namespace pulson::python
