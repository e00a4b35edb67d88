// Noise models written in Python.

#include "models.hpp"

#include <cmath>
#include <optional>
#include <random>

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "pulson/core/errors.hpp"
#include "pulson/noise/noise_table.hpp"
#include "shell/host.hpp"

namespace pulson::python {
namespace {

// (N, d) of d×N; the function that gets it may keep it.
py::array copy_of(const Points& points) { return array_of(Points(points)); }

using State = PhaseState;

State scaled_sum(const State& a, double factor, const State& b) { return {a.q + factor * b.q, a.p + factor * b.p}; }

double size_of(const State& a) { return std::sqrt(a.q.squaredNorm() + a.p.squaredNorm()); }

// Of differences of fourth order, in lengths of the shape: what is cut off and what is rounded are of one size, and
// differences of differences still have ten digits.
constexpr double kStep = 4e-3;

/// A model whose potentials, and as many of their derivatives as its author has, are functions in Python of q and p,
/// (N, d). Its traits are measured at a state.
class OwnNoise final : public NoiseModel, public std::enable_shared_from_this<OwnNoise> {
 public:
  OwnNoise(py::object potentials, py::object gradient, py::object hessian, const Points& like, std::string name)
      : potentials_(std::move(potentials)),
        gradient_(std::move(gradient)),
        hessian_(std::move(hessian)),
        name_(std::move(name)),
        dimension_(static_cast<int>(like.rows())),
        count_(static_cast<int>(like.cols())) {
    if (!like.allFinite() || count_ == 0) throw InputError("like needs landmarks without missing coordinates");
    const double extent = (like.rowwise().maxCoeff() - like.rowwise().minCoeff()).maxCoeff();
    length_ = extent > 0 ? extent : std::max(1.0, like.cwiseAbs().maxCoeff());
    measure(like);
  }

  ~OwnNoise() override {
    const py::gil_scoped_acquire lock;
    potentials_ = gradient_ = hessian_ = py::object();
  }
  OwnNoise(const OwnNoise&) = delete;
  OwnNoise& operator=(const OwnNoise&) = delete;

  std::string spec() const override { return name_; }
  int channels(int, int) const override { return channels_; }
  NoiseTraits traits() const override { return traits_; }
  void check(int dimension, int count) const override {
    if (dimension != dimension_ || count != count_)
      throw InputError(fmt::format("noise '{}' was made for {} landmarks in {}D, and is used for {} in {}D", name_,
                                   count_, dimension_, count, dimension));
  }
  std::vector<std::string> parameter_names() const override { return {}; }
  Eigen::VectorXd parameters() const override { return {}; }
  std::shared_ptr<const NoiseModel> with_parameters(const Eigen::VectorXd&) const override {
    throw InputError(fmt::format("noise '{}' has no numbers that can be fitted", name_));
  }

  void add_to(const NoiseSums<double>& sums) const override {
    const State at{sums.at.q, sums.at.p};
    if (sums.potentials) *sums.potentials += h(at);
    if (sums.gradient) add(dh(at, sums.w), *sums.gradient);
    if (sums.compensation && traits_.compensated) add(dg(at), *sums.compensation);
  }

  void add_to(const NoiseSums<Dual>& sums) const override {
    const Points q = value_of(sums.at.q), p = value_of(sums.at.p);
    const State at{q, p}, change{change_of(sums.at.q), change_of(sums.at.p)};
    if (sums.potentials) {
      const Eigen::VectorXd values = h(at), changes = along(
                                                change, [&](const State& s) { return h(s); }, at);
      for (Eigen::Index i = 0; i < values.size(); ++i) (*sums.potentials)[i] += Dual(values[i], changes[i]);
    }
    if (sums.gradient) add(dh(at, sums.w), ddh(at, sums.w, change), *sums.gradient);
    if (sums.compensation && traits_.compensated)
      add(dg(at),
          state_along(
              change, [&](const State& s) { return dg(s); }, at),
          *sums.compensation);
  }

  void add_to(const SpaceSums<double>&) const override {}
  void add_to(const SpaceSums<Dual>&) const override {}

  template <class See>
  void show_functions(const See& see) const {
    for (const py::object* function : {&potentials_, &gradient_, &hessian_}) see(*function);
  }
  void forget_functions() { potentials_ = gradient_ = hessian_ = py::none(); }

  py::dict traits_dict() const {
    py::dict facts;
    facts["channels"] = channels_;
    facts["moves_positions"] = traits_.moves_positions();
    facts["moves_momenta"] = traits_.moves_momenta;
    facts["additive"] = traits_.additive;
    facts["compensated"] = traits_.compensated;
    facts["linear"] = traits_.linear;
    facts["translation_invariant"] = traits_.translation_invariant;
    return facts;
  }

 private:
  static Points value_of(const MatrixOf<Dual>& x) {
    Points values(x.rows(), x.cols());
    for (Eigen::Index i = 0; i < x.size(); ++i) values.data()[i] = x.data()[i].value;
    return values;
  }
  static Points change_of(const MatrixOf<Dual>& x) {
    Points changes(x.rows(), x.cols());
    for (Eigen::Index i = 0; i < x.size(); ++i) changes.data()[i] = x.data()[i].change;
    return changes;
  }
  static void add(const State& what, StateOf<double>& to) {
    to.q += what.q;
    to.p += what.p;
  }
  static void add(const State& values, const State& changes, StateOf<Dual>& to) {
    for (Eigen::Index i = 0; i < values.q.size(); ++i) {
      to.q.data()[i] += Dual(values.q.data()[i], changes.q.data()[i]);
      to.p.data()[i] += Dual(values.p.data()[i], changes.p.data()[i]);
    }
  }

  // A derivative along a change of the state.
  double step_for(const State& change) const {
    const double size = std::max(change.q.norm() / length_, change.p.norm());
    return size > 0 ? kStep / size : 0;
  }
  template <class Function>
  Eigen::VectorXd along(const State& change, const Function& f, const State& at) const {
    const double t = step_for(change);
    if (t == 0) return Eigen::VectorXd::Zero(channels_);
    const auto value = [&](double by) -> Eigen::VectorXd { return f(scaled_sum(at, by, change)); };
    return slope_of<Eigen::VectorXd>(value(-2 * t), value(-t), value(t), value(2 * t), t);
  }
  template <class Function>
  State state_along(const State& change, const Function& f, const State& at) const {
    const double t = step_for(change);
    if (t == 0) return {Points::Zero(dimension_, count_), Points::Zero(dimension_, count_)};
    const State a = f(scaled_sum(at, -2 * t, change)), b = f(scaled_sum(at, -t, change));
    const State c = f(scaled_sum(at, t, change)), e = f(scaled_sum(at, 2 * t, change));
    return {slope_of<Points>(a.q, b.q, c.q, e.q, t), slope_of<Points>(a.p, b.p, c.p, e.p, t)};
  }

  Eigen::VectorXd h(const State& at) const {
    look_for_stop();
    const Callback python;
    const Doubles values = doubles_of(potentials_(copy_of(at.q), copy_of(at.p)), "what potentials returns");
    if (values.ndim() != 1 || (channels_ >= 0 && values.size() != channels_))
      throw InputError(fmt::format("noise '{}': potentials must return one number for each channel, (C,)", name_));
    Eigen::VectorXd result = Eigen::Map<const Eigen::VectorXd>(values.data(), values.size());
    if (!result.allFinite())
      throw InputError(fmt::format("noise '{}': potentials returns a number that is not finite", name_));
    return result;
  }

  State pair_of(const py::object& value, const char* what) const {
    if (!py::isinstance<py::tuple>(value) || py::len(value) != 2)
      throw InputError(fmt::format("noise '{}': {} must return a pair: by q and by p", name_, what));
    const py::tuple both = value;
    State state{points_of(both[0], what), points_of(both[1], what)};
    for (const Points* part : {&state.q, &state.p})
      if (part->rows() != dimension_ || part->cols() != count_)
        throw InputError(fmt::format("noise '{}': {} must return two arrays of the shape ({}, {})", name_, what, count_,
                                     dimension_));
    return state;
  }

  // ∇h_w
  State dh(const State& at, const Eigen::VectorXd& w) const {
    if (gradient_.is_none()) return dh_by_differences(at, w);
    const Callback python;
    return pair_of(gradient_(copy_of(at.q), copy_of(at.p), array_of(w)), "gradient");
  }

  State dh_by_differences(const State& at, const Eigen::VectorXd& w) const {
    State result{Points::Zero(dimension_, count_), Points::Zero(dimension_, count_)};
    const double t = kStep * length_;
    State moved = at;
    const auto value = [&](double& coordinate, double by) {
      const double kept = coordinate;
      coordinate += by;
      const double sum = w.dot(h(moved));
      coordinate = kept;
      return sum;
    };
    for (Eigen::Index i = 0; i < at.q.size(); ++i) {
      double &x = moved.q.data()[i], &y = moved.p.data()[i];
      result.q.data()[i] = slope_of(value(x, -2 * t), value(x, -t), value(x, t), value(x, 2 * t), t);
      result.p.data()[i] = (value(y, 1) - value(y, -1)) / 2;  // affine
    }
    return result;
  }

  // ∇²h_w along a change
  State ddh(const State& at, const Eigen::VectorXd& w, const State& change) const {
    if (traits_.additive) return {Points::Zero(dimension_, count_), Points::Zero(dimension_, count_)};
    if (hessian_.is_none())
      return state_along(
          change, [&](const State& s) { return dh(s, w); }, at);
    const Callback python;
    return pair_of(hessian_(copy_of(at.q), copy_of(at.p), array_of(w), copy_of(change.q), copy_of(change.p)),
                   "hessian");
  }

  // ∇G of G = ¼ Σ h_i,q·h_i,p is ¼ Σ ∇²h_i (h_i,p, h_i,q).
  State dg(const State& at) const {
    State result{Points::Zero(dimension_, count_), Points::Zero(dimension_, count_)};
    for (int i = 0; i < channels_; ++i) {
      const Eigen::VectorXd one = Eigen::VectorXd::Unit(channels_, i);
      const State slope = dh(at, one);
      result = scaled_sum(result, 0.25, ddh(at, one, {slope.p, slope.q}));
    }
    return result;
  }

  void require_same(const State& own, const State& differences, double tolerance, const char* what) const {
    const double error = size_of(scaled_sum(own, -1, differences));
    const double scale = std::max(size_of(own), size_of(differences));
    if (!(error <= tolerance * std::max(scale, 1e-8)))
      throw InputError(
          fmt::format("noise '{}': {} differs from central differences by {:.2g} of its size; it is no "
                      "derivative of what it should be",
                      name_, what, error / scale));
  }

  // Checks the derivatives at a state about `like`, and finds the traits there.
  void measure(const Points& like) {
    std::mt19937_64 bits(20261127);
    std::normal_distribution<double> normal;
    const auto random = [&] {
      Points x(dimension_, count_);
      for (Eigen::Index i = 0; i < x.size(); ++i) x.data()[i] = normal(bits);
      return x;
    };
    const State at{like + 1e-2 * length_ * random(), random()};
    channels_ = static_cast<int>(h(at).size());
    if (channels_ == 0) throw InputError(fmt::format("noise '{}' has no channels", name_));
    const Eigen::VectorXd w = Eigen::VectorXd::NullaryExpr(channels_, [&] { return normal(bits); });
    const State change{random() * length_, random()};
    // Affine in p: second differences vanish.
    const Eigen::VectorXd here = h(at), more = h({at.q, at.p + change.p}), twice = h({at.q, at.p + 2 * change.p});
    if ((twice - 2 * more + here).norm() > 1e-9 * (here.norm() + more.norm() + twice.norm()))
      throw InputError(fmt::format("noise '{}': potentials must be affine in p", name_));
    if (!gradient_.is_none()) require_same(dh(at, w), dh_by_differences(at, w), 1e-5, "gradient");
    if (!hessian_.is_none())
      require_same(ddh(at, w, change),
                   state_along(
                       change, [&](const State& s) { return dh(s, w); }, at),
                   1e-3, "hessian");
    const auto is_small = [](double part, double whole) { return part <= 1e-7 * whole; };
    const State slope = dh(at, w), elsewhere = dh(scaled_sum(at, 0.1, change), w);
    const double size = size_of(slope);
    const bool moves_positions = !is_small(slope.p.norm(), size);
    double compensation = 0, parts = 0;
    for (int i = 0; i < channels_; ++i) {
      const State one = dh(at, Eigen::VectorXd::Unit(channels_, i));
      compensation += std::abs((one.q.array() * one.p.array()).sum());
      parts += size_of(one) * size_of(one);
    }
    const Eigen::VectorXd shifted = h({at.q.array() + 0.37 * length_, at.p});
    const bool is_additive = is_small(size_of(scaled_sum(slope, -1, elsewhere)), size);
    traits_ = {.displacement = moves_positions ? Displacement::landmarks() : Displacement::none(),
               .moves_momenta = !is_small(slope.q.norm(), size),
               .additive = is_additive,
               .compensated = compensation > 1e-7 * parts,
               .translation_invariant = (shifted - here).norm() <= 1e-9 * here.norm(),
               .diffeomorphic = !moves_positions,
               .local = is_additive,
               .linear = h({at.q, Points::Zero(dimension_, count_)}).norm() <= 1e-12 * here.norm()};
  }

  py::object potentials_, gradient_, hessian_;
  std::string name_;
  int dimension_, count_, channels_ = -1;
  double length_ = 1;
  NoiseTraits traits_{.displacement = Displacement::landmarks(), .additive = false};  // until it is measured
};

struct ShowNoiseFunctions {
  template <class See>
  void operator()(const OwnNoise& own, const See& see) const {
    if (own.weak_from_this().use_count() == 1) own.show_functions(see);
  }
};
struct ForgetNoiseFunctions {
  void operator()(OwnNoise& own) const { own.forget_functions(); }
};

}  // namespace

std::shared_ptr<const NoiseModel> noise_of(const py::handle& value, const Points& q) {
  if (value.is_none()) return make_noise("none");
  if (py::isinstance<NoiseModel>(value)) return value.cast<std::shared_ptr<NoiseModel>>();
  Landmarks shape;
  shape.points = q;
  return make_noise(py::str(value).cast<std::string>(), shape);
}

void add_noise_models(py::module_& module) {
  py::class_<NoiseModel, std::shared_ptr<NoiseModel>>(module, "_NoiseModel").def("__str__", &NoiseModel::spec);
  py::class_<OwnNoise, NoiseModel, std::shared_ptr<OwnNoise>>(
      module, "OwnNoise", collected<OwnNoise>(ShowNoiseFunctions{}, ForgetNoiseFunctions{}),
      R"(A noise model of one's own.

Landmarks follow dq = H_p dt + sum_i h_i,p dW_i, dp = -H_q dt - sum_i h_i,q dW_i. `potentials(q, p)` returns the h_i,
(C,), affine in p; `gradient(q, p, w)` the derivatives of sum_i w_i h_i by q and by p, and `hessian(q, p, w, dq, dp)`
the change of these along (dq, dp). Those that are not given are central differences; those that are, are compared
with them when the object is made. `like` is a shape as the model is for.

>>> import numpy as np, pulson
>>> shake = pulson.OwnNoise(lambda q, p: 0.1 * p.ravel(),
...                         lambda q, p, w: (0 * q, 0.1 * w.reshape(p.shape)), like=np.eye(2))
>>> shake.traits["channels"], shake.traits["additive"]
(4, True)
)")
      .def(py::init([](py::object potentials, py::object gradient, py::object hessian, const py::object& like,
                       std::string name) {
             return std::make_shared<OwnNoise>(std::move(potentials), std::move(gradient), std::move(hessian),
                                               points_of(like, "like"), std::move(name));
           }),
           py::arg("potentials"), py::arg("gradient") = py::none(), py::arg("hessian") = py::none(), py::kw_only(),
           py::arg("like"), py::arg("name") = "own")
      .def_property_readonly("traits", &OwnNoise::traits_dict)
      .def("__repr__", [](const OwnNoise& self) {
        return fmt::format("<OwnNoise '{}': {} channels>", self.spec(), self.channels(0, 0));
      });
}

}  // namespace pulson::python
