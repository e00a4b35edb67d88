#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/ranges.h>

#include "bump_fields.hpp"
#include "bump_noise_body.hpp"
#include "gaussian_pairs.hpp"
#include "models.hpp"
#include "pulson/noise/differentiated_noise.hpp"

namespace pulson {
namespace {

// Of all landmarks at once, N×d and N, so that they are in vector lanes.
template <class T>
using LanesOf = Eigen::Array<T, Eigen::Dynamic, Eigen::Dynamic>;
template <class T>
using LaneOf = Eigen::Array<T, Eigen::Dynamic, 1>;

template <class T>
LanesOf<T> lanes(const MatrixOf<T>& x) {
  return x.transpose().array();
}

// One scalar function φ of space with its derivatives, for any scalar.
template <class T>
struct FieldJet {
  LaneOf<T> value;
  LanesOf<T> slope;  // ∇φ
};

// φ_f, f = 1..F: each gives d fields ξ = β φ_f e_j. θ = (β), or (β, the width or wavenumber).
class ScalarFields {
 public:
  enum class Kind { kConstant, kBump, kGrid, kCosine };

  static ScalarFields constant() { return {Kind::kConstant, {}, 0}; }
  static ScalarFields bumps(Points centres) { return {Kind::kBump, std::move(centres), 0}; }
  static ScalarFields grid(Points centres, int count) { return {Kind::kGrid, std::move(centres), count}; }
  static ScalarFields cosines() { return {Kind::kCosine, {}, 0}; }

  Kind kind() const { return kind_; }
  const Points& centres() const { return centres_; }
  const BumpTicks& ticks() const { return ticks_; }
  int grid_count() const { return grid_count_; }
  bool has_centres() const { return kind_ == Kind::kBump || kind_ == Kind::kGrid; }

  int count(int dimension) const {
    if (kind_ == Kind::kConstant) return 1;
    return kind_ == Kind::kCosine ? dimension : static_cast<int>(centres_.cols());
  }

  template <class T>
  void take_value(Eigen::Index f, const LanesOf<T>& x, const VectorOf<T>& theta, LaneOf<T>& value) const {
    value.setConstant(x.rows(), T(has_centres() ? 0 : 1));
    if (kind_ == Kind::kCosine) value = (theta[1] * x.col(f)).cos();
    if (!has_centres()) return;
    for (Eigen::Index axis = 0; axis < x.cols(); ++axis) value += (x.col(axis) - T(centres_(axis, f))).square();
    // Number by number: Eigen's exponential of a full vector differs in the last bit from that of what is left over.
    const T c = T(-1) / (theta[1] * theta[1]);
    value = value.unaryExpr([c](const T& squared) {
      using std::exp;
      return exp(c * squared);
    });
  }

  // Of a field without centres.
  template <class T>
  void take_jet(Eigen::Index f, const LanesOf<T>& x, const VectorOf<T>& theta, FieldJet<T>& jet) const {
    take_value(f, x, theta, jet.value);
    jet.slope.setConstant(x.rows(), x.cols(), T(0));
    if (kind_ == Kind::kCosine) jet.slope.col(f) = -theta[1] * (theta[1] * x.col(f)).sin();
  }

  // ∇²φ v of a field without centres. @param jet of the same places
  template <class T>
  LanesOf<T> curvature(Eigen::Index f, const LanesOf<T>& x, const FieldJet<T>& jet, const VectorOf<T>& theta,
                       const LanesOf<T>& v) const {
    LanesOf<T> result = LanesOf<T>::Constant(x.rows(), x.cols(), T(0));
    if (kind_ == Kind::kCosine) result.col(f) = (-theta[1] * theta[1]) * jet.value * v.col(f);
    return result;
  }

 private:
  ScalarFields(Kind kind, Points centres, int grid_count)
      : kind_(kind), centres_(std::move(centres)), ticks_(centres_), grid_count_(grid_count) {}

  Kind kind_;
  Points centres_;  // d×F
  BumpTicks ticks_;
  int grid_count_;
};

// h = Σ_a p_a·ξ_i(q_a), (8)-(10), with fields ξ = β φ_f e_j, axis j fastest. Momenta get −(∇ξ_i)ᵀp. The compensation is
// again of this form: G = Σ_a p_a·Y(q_a) with Y = ¼β² Σ_f φ_f ∇φ_f.
struct PSd : NoiseFormula {
  ScalarFields fields = ScalarFields::constant();

  bool is_constant() const { return fields.kind() == ScalarFields::Kind::kConstant; }

  std::vector<std::string> parameter_names() const {
    if (is_constant()) return {"beta"};
    return {"beta", fields.has_centres() ? "width" : "wavenumber"};
  }
  std::string spec(const Eigen::VectorXd& theta) const {
    switch (fields.kind()) {
      case ScalarFields::Kind::kConstant:
        return fmt::format("p-sd:beta={}", theta[0]);
      case ScalarFields::Kind::kCosine:
        return fmt::format("p-sd:beta={},fields=cos,wavenumber={}", theta[0], theta[1]);
      case ScalarFields::Kind::kGrid:
        return fmt::format("p-sd:beta={},fields=grid,count={},width={}", theta[0], fields.grid_count(), theta[1]);
      case ScalarFields::Kind::kBump:
        break;
    }
    std::string centre;
    for (const double x : fields.centres().reshaped()) centre += fmt::format("{}{}", centre.empty() ? "" : "/", x);
    return fmt::format("p-sd:beta={},fields=bump,center={},width={}", theta[0], centre, theta[1]);
  }
  int channels(int dimension, int /*count*/) const { return dimension * fields.count(dimension); }
  std::vector<NoiseAmplitude> amplitudes(int channels) const { return {NoiseAmplitude::of_all(0, channels)}; }
  void describe(int dimension, const Eigen::VectorXd& theta, std::vector<NoiseChannel>& channels) const {
    for (int i = 0; i < static_cast<int>(channels.size()); ++i) {
      NoiseChannel& channel = channels[static_cast<std::size_t>(i)];
      channel.axis = i % dimension;
      const int f = i / dimension;
      if (fields.has_centres()) channel.center = fields.centres().col(f);
      if (fields.kind() == ScalarFields::Kind::kCosine)
        channel.wavevector = theta[1] * Eigen::VectorXd::Unit(dimension, f);
    }
  }
  NoiseTraits traits() const {
    return {.displacement = Displacement::field(),
            .moves_momenta = !is_constant(),
            .additive = is_constant(),
            .compensated = !is_constant(),
            .translation_invariant = is_constant(),
            .linear = true};
  }
  void check(int dimension, int /*count*/, const std::string& spec) const {
    if (fields.has_centres() && fields.centres().rows() != dimension)
      throw InputError(fmt::format("noise '{}': its centres are points in {}D, the shape is in {}D", spec,
                                   fields.centres().rows(), dimension));
  }

  template <class T>
  void add_potentials(const StateOf<T>& state, const VectorOf<T>& theta, VectorOf<T>& h) const {
    const Eigen::Index d = state.q.rows();
    const LanesOf<T> x = lanes(state.q);
    LaneOf<T> phi;
    for (Eigen::Index f = 0; f < fields.count(static_cast<int>(d)); ++f) {
      fields.take_value(f, x, theta, phi);
      h.segment(f * d, d) += theta[0] * (state.p * phi.matrix());
    }
  }

  template <class T>
  void add_gradient(const StateOf<T>& state, const VectorOf<T>& theta, const Eigen::VectorXd& w,
                    StateOf<T>& gradient) const {
    const Eigen::Index d = state.q.rows();
    if (fields.has_centres()) {
      for_each_part(state.q, theta, [&](auto& noise, Eigen::Index from) {
        noise.TakeIncrements(w.data());
        noise.AddVelocity(w.data(), gradient.p.data() + from);
        noise.AddForce(state.p.data() + from, gradient.q.data() + from);
      });
      return;
    }
    const LanesOf<T> x = lanes(state.q);
    FieldJet<T> phi;
    for (Eigen::Index f = 0; f < fields.count(static_cast<int>(d)); ++f) {
      if ((w.segment(f * d, d).array() == 0).all()) continue;
      const VectorOf<T> beta_w = theta[0] * w.segment(f * d, d).unaryExpr([](double number) { return T(number); });
      fields.take_jet(f, x, theta, phi);
      gradient.p.noalias() += beta_w * phi.value.matrix().transpose();
      const VectorOf<T> along = state.p.transpose() * beta_w;
      gradient.q += (phi.slope.colwise() * along.array()).matrix().transpose();
    }
  }

  template <class T>
  void add_compensation_gradient(const StateOf<T>& state, const VectorOf<T>& theta, StateOf<T>& gradient) const {
    if (is_constant()) return;
    if (fields.has_centres()) {
      for_each_part(state.q, theta, [&](const auto& noise, Eigen::Index from) {
        noise.AddCompensationVelocity(gradient.p.data() + from);
        noise.AddCompensationForce(state.p.data() + from, gradient.q.data() + from);
      });
      return;
    }
    const T quarter = T(0.25) * theta[0] * theta[0];
    const LanesOf<T> x = lanes(state.q);
    const LanesOf<T> p = lanes(state.p);
    FieldJet<T> phi;
    for (Eigen::Index f = 0; f < fields.count(static_cast<int>(state.q.rows())); ++f) {
      fields.take_jet(f, x, theta, phi);
      const LaneOf<T> along = (phi.slope * p).rowwise().sum();
      const LanesOf<T> curved = fields.curvature(f, x, phi, theta, p);
      gradient.p += quarter * (phi.slope.colwise() * phi.value).matrix().transpose();
      gradient.q += quarter * (phi.slope.colwise() * along + curved.colwise() * phi.value).matrix().transpose();
    }
  }

  template <class T>
  void add_spatial_noise(const MatrixOf<T>& x, const Points& /*q*/, const Eigen::VectorXd& theta,
                         const Eigen::VectorXd& w, MatrixOf<T>& field) const {
    StateOf<T> gradient{MatrixOf<T>::Constant(x.rows(), x.cols(), T(0)), field};
    add_gradient<T>(StateOf<T>{x, gradient.q}, theta.cast<T>(), w, gradient);
    field = gradient.p;
  }
  template <class T>
  void add_spatial_compensation(const MatrixOf<T>& x, const Points& /*q*/, const Eigen::VectorXd& theta,
                                MatrixOf<T>& field) const {
    StateOf<T> gradient{MatrixOf<T>::Constant(x.rows(), x.cols(), T(0)), field};
    add_compensation_gradient<T>(StateOf<T>{x, gradient.q}, theta.cast<T>(), gradient);
    field = gradient.p;
  }

 private:
  static constexpr Eigen::Index kPart = 16;  // places: φ and ∇φ of 10,000 bumps are kept for as many at once

  // task(formula at some of the places, index of their first coordinate) for all places, a part of them at a time.
  template <class T, class Task>
  void for_each_part(const MatrixOf<T>& q, const VectorOf<T>& theta, const Task& task) const {
    with_dimension(q.rows(), [&](auto dimension) {
      using Noise = HWY_NAMESPACE::BumpNoise<decltype(dimension)::value, T>;
      const T range = theta[1] * theta[1];
      const T c = T(-1) / range;
      const auto constants = pair_noise_constants(theta[0], range);
      std::vector<T> memory(Noise::MemorySize(static_cast<std::size_t>(std::min(kPart, q.cols())), fields.ticks()));
      for (Eigen::Index first = 0; first < q.cols(); first += kPart) {
        Noise noise(static_cast<std::size_t>(std::min(kPart, q.cols() - first)), fields.ticks(), constants,
                    memory.data());
        noise.MoveTo(
            q.data() + first * q.rows(), [](double x) { return T(x); },
            [c](const T& squared) {
              using std::exp;
              return exp(c * squared);
            });
        task(noise, first * q.rows());
      }
    });
  }
};

// Centres given as x/y/x/y: d×F. Without a shape they are on a line.
Points given_centres(const Parameters& parameters, const Landmarks& shape) {
  if (parameters.text("center") == "none") throw InputError("noise 'p-sd': fields=bump needs center, as in center=0/0");
  const std::vector<double> numbers = parameters.numbers("center");
  const Eigen::Index d = shape.count() == 0 ? 1 : shape.dimension();
  const auto size = static_cast<Eigen::Index>(numbers.size());
  if (size % d != 0)
    throw InputError(fmt::format("noise 'p-sd': center has {} numbers; in {}D each centre takes {}, as in {}", size, d,
                                 d, d == 2 ? "center=0/0" : "center=0/0/0"));
  return Eigen::Map<const Points>(numbers.data(), d, size / d);
}

// count^d centres from corner to corner of the box of the shape; one in the middle of an axis along which it is flat.
Points grid_centres(const Landmarks& shape, int count) {
  const auto [low, high] = bounding_box(shape.points);
  const Eigen::Index d = shape.dimension();
  std::vector<Eigen::VectorXd> ticks;
  Eigen::Index total = 1;
  for (Eigen::Index axis = 0; axis < d; ++axis) {
    const bool one = count == 1 || !(high[axis] > low[axis]);
    ticks.push_back(one ? Eigen::VectorXd::Constant(1, low[axis] + (high[axis] - low[axis]) / 2)
                        : Eigen::VectorXd::LinSpaced(count, low[axis], high[axis]).eval());
    total *= ticks.back().size();
  }
  Points centres(d, total);
  for (Eigen::Index i = 0; i < total; ++i) {
    Eigen::Index rest = i;
    for (Eigen::Index axis = 0; axis < d; ++axis) {
      const Eigen::VectorXd& tick = ticks[static_cast<std::size_t>(axis)];
      centres(axis, i) = tick[rest % tick.size()];
      rest /= tick.size();
    }
  }
  return centres;
}

constexpr int kMostOnASide = 100;
constexpr int kMostBumps = 10000;

ScalarFields make_grid(const Parameters& parameters, const Landmarks& shape) {
  const double count = parameters.number("count");
  if (!(count >= 1 && count <= kMostOnASide) || count != std::floor(count))
    throw InputError(
        fmt::format("noise 'p-sd': count is {}; it must be a whole number from 1 to {}", count, kMostOnASide));
  if (shape.count() == 0) throw InputError("noise 'p-sd': fields=grid needs a shape, whose box it covers");
  const double bumps = std::pow(count, shape.dimension());
  if (bumps > kMostBumps)
    throw InputError(fmt::format(
        "noise 'p-sd': count={} makes {} bumps in {}D; at most {} can be used, which is "
        "count={}",
        count, bumps, shape.dimension(), kMostBumps, std::floor(std::pow(kMostBumps, 1.0 / shape.dimension()) + 1e-9)));
  return ScalarFields::grid(grid_centres(shape, static_cast<int>(count)), static_cast<int>(count));
}

// The distance of the nearest neighbours on a grid; 0 where it has one point, or there is no grid.
double grid_spacing(const ScalarFields& fields) {
  if (fields.grid_count() < 2) return 0;
  const Points& centres = fields.centres();
  double nearest = 0;
  for (Eigen::Index i = 1; i < centres.cols(); ++i) {
    const double distance = (centres.col(i) - centres.col(0)).norm();
    if (nearest == 0 || distance < nearest) nearest = distance;
  }
  return nearest;
}

// The distance of neighbours on a grid, or for other centres a quarter of the diameter of the shape.
double automatic_width(const ScalarFields& fields, const Landmarks& shape) {
  const double spacing = grid_spacing(fields);
  const double width = spacing > 0 ? spacing : shape.count() > 1 ? diameter(shape.points) / 4 : 0;
  if (!(width > 0)) throw InputError("noise 'p-sd': width=auto needs at least two distinct landmarks; give a number");
  return width;
}

// What each kind of fields reads beside beta.
const std::map<std::string, std::vector<std::string>> kKinds = {
    {"constant", {}}, {"grid", {"count", "width"}}, {"bump", {"center", "width"}}, {"cos", {"wavenumber"}}};

void check_kind(const Parameters& parameters) {
  const std::string& kind = parameters.text("fields");
  std::vector<std::string> kinds;
  for (const auto& entry : kKinds) kinds.push_back(entry.first);
  if (!kKinds.contains(kind))
    throw InputError(fmt::format("noise 'p-sd': fields is '{}'{}", kind, advice_on_name(kind, kinds)));
  for (const ParameterInfo& parameter : p_sd().parameters) {
    const std::vector<std::string>& read = kKinds.at(kind);
    if (parameter.name == "beta" || parameter.name == "fields" ||
        parameters.text(parameter.name) == parameter.default_text ||
        std::find(read.begin(), read.end(), parameter.name) != read.end())
      continue;
    throw InputError(fmt::format("noise 'p-sd': fields={} does not use {}", kind, parameter.name));
  }
}

ScalarFields make_fields(const Parameters& parameters, const Landmarks& shape) {
  const std::string& kind = parameters.text("fields");
  if (kind == "constant") return ScalarFields::constant();
  if (kind == "cos") return ScalarFields::cosines();
  if (kind == "grid") return make_grid(parameters, shape);
  return ScalarFields::bumps(given_centres(parameters, shape));
}

std::shared_ptr<const NoiseModel> make_p_sd(const Parameters& parameters, const Landmarks& shape) {
  check_kind(parameters);
  const double beta = parameters.positive("beta");
  PSd formula;
  formula.fields = make_fields(parameters, shape);
  if (formula.is_constant()) return make_differentiated(std::move(formula), {beta});
  if (!formula.fields.has_centres())
    return make_differentiated(std::move(formula), {beta, parameters.positive("wavenumber")});
  const double width =
      parameters.is_auto("width") ? automatic_width(formula.fields, shape) : parameters.positive("width");
  return make_differentiated(std::move(formula), {beta, width});
}

}  // namespace

BumpTicks::BumpTicks(const Points& centres) : first{0}, of_centre(static_cast<std::size_t>(centres.size())) {
  for (Eigen::Index axis = 0; axis < centres.rows(); ++axis) {
    std::vector<double> of_axis(centres.row(axis).begin(), centres.row(axis).end());
    std::sort(of_axis.begin(), of_axis.end());
    of_axis.erase(std::unique(of_axis.begin(), of_axis.end()), of_axis.end());
    for (Eigen::Index f = 0; f < centres.cols(); ++f) {
      const auto tick = std::lower_bound(of_axis.begin(), of_axis.end(), centres(axis, f));
      of_centre[static_cast<std::size_t>(f * centres.rows() + axis)] =
          ticks.size() + static_cast<std::size_t>(tick - of_axis.begin());
    }
    ticks.insert(ticks.end(), of_axis.begin(), of_axis.end());
    first.push_back(ticks.size());
  }
}

std::optional<BumpFields> bump_fields(const NoiseModel& noise) {
  const auto* model = dynamic_cast<const DifferentiatedNoise<PSd>*>(&noise);
  if (model == nullptr || !model->formula().fields.has_centres()) return std::nullopt;
  const Eigen::VectorXd theta = model->parameters();
  return BumpFields{model->formula().fields.centres(), theta[0], theta[1]};
}

NoiseTable::Row p_sd() {
  return {"p-sd",
          {{"beta", "", "amplitude, length per square root of time; 50%: of the diameter", true},
           {"fields", "constant", "constant, grid, bump or cos; each is a field along every axis"},
           {"count", "4", "fields=grid: bumps along each side of the shape's box"},
           {"center", "none", "fields=bump: coordinates of one or more centres, as in 0/0"},
           {"width", "auto", "of bumps exp(-|x - c|^2/width^2); auto: their spacing, or diameter/4", true},
           {"wavenumber", "1", "fields=cos: cos(wavenumber x) along each axis"}},
          "h = sum_a p_a.xi(q_a): noise by fields over space; flows stay diffeomorphic (section 2.2)",
          make_p_sd};
}

}  // namespace pulson
