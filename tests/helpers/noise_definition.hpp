#pragma once

// The potentials h_i(q,p) of every noise model in plain loops for any number type, and by Jets whatever follows from
// them: what the library is tested against. A new row of noise_table() needs its potentials in potentials_of() and its
// parameters in fitted(); without them every test of the row throws.

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <ceres/jet.h>

#include "kernel_definition.hpp"
#include "pulson/core/landmarks.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson {

/// q_a^j at a·d + j, and p_a^j behind all of q.
template <class T>
struct Coordinates {
  const std::vector<T>& x;
  int d;
  int n;

  const T& q(int a, int j) const { return x[a * d + j]; }
  const T& p(int a, int j) const { return x[(n + a) * d + j]; }
  T squared_distance(int a, int b) const {
    T sum = constant<T>(0);
    for (int j = 0; j < d; ++j) sum += (q(a, j) - q(b, j)) * (q(a, j) - q(b, j));
    return sum;
  }
};

inline std::vector<double> coordinates(const PhaseState& state) {
  std::vector<double> x(state.q.reshaped().begin(), state.q.reshaped().end());
  x.insert(x.end(), state.p.reshaped().begin(), state.p.reshaped().end());
  return x;
}

/// x + ε change
template <class T>
std::vector<ceres::Jet<T, 1>> moved(const std::vector<T>& x, const std::vector<double>& change) {
  std::vector<ceres::Jet<T, 1>> jets;
  for (std::size_t i = 0; i < x.size(); ++i) {
    jets.emplace_back(x[i]);
    jets.back().v[0] = constant<T>(change[i]);
  }
  return jets;
}

inline std::vector<double> unit(std::size_t size, std::size_t i) {
  std::vector<double> e(size, 0);
  e[i] = 1;
  return e;
}

/// 1/x; the division of Jets stops at Jets of Jets.
inline double inverse(double x) { return 1 / x; }
template <class T, int N>
ceres::Jet<T, N> inverse(const ceres::Jet<T, N>& x) {
  const T value = inverse(x.a);
  ceres::Jet<T, N> result(value);
  for (int i = 0; i < N; ++i) result.v[i] = -(value * value * x.v[i]);
  return result;
}

class DefinedNoise {
 public:
  DefinedNoise(const std::string& spec, const Landmarks& shape) : d_(shape.dimension()), n_(shape.count()) {
    for (const Spec& term : parse_spec_sum(spec, "noise")) terms_.push_back(read(term, shape));
  }

  /// The same noise of a state with one more landmark, which has none of the channels.
  DefinedNoise with_tracer() const {
    DefinedNoise more = *this;
    ++more.tracers_;
    return more;
  }

  /// θ of all terms, and its names within them.
  std::vector<double> theta() const {
    std::vector<double> all;
    for (const Term& term : terms_)
      for (const auto& [name, value] : term.theta) all.push_back(value);
    return all;
  }
  std::vector<std::string> names() const {
    std::vector<std::string> all;
    for (const Term& term : terms_)
      for (const auto& [name, value] : term.theta) all.push_back(name);
    return all;
  }

  /// h_i; those that are no field over space are left at 0 on request.
  template <class T>
  std::vector<T> potentials(const std::vector<T>& x, const std::vector<T>& theta, bool fields_alone = false) const {
    std::vector<T> all;
    auto first = theta.begin();
    for (const Term& term : terms_) {
      const auto last = first + static_cast<std::ptrdiff_t>(term.theta.size());
      std::vector<T> h = potentials_of(term, Coordinates<T>{x, d_, n_ + tracers_}, std::vector<T>(first, last));
      if (fields_alone && term.name != "p-sd" && term.name != "kunita" && term.name != "linear")
        h.assign(h.size(), constant<T>(0));
      all.insert(all.end(), h.begin(), h.end());
      first = last;
    }
    return all;
  }

  /// ∂h_i/∂x_m
  template <class T>
  std::vector<T> slopes(const std::vector<T>& x, const std::vector<T>& theta, std::size_t m,
                        bool fields_alone = false) const {
    const auto h =
        potentials(moved(x, unit(x.size(), m)), moved(theta, std::vector<double>(theta.size(), 0)), fields_alone);
    std::vector<T> slope;
    for (const auto& jet : h) slope.push_back(jet.v[0]);
    return slope;
  }

  /// G = ¼ Σ_i h_i,q·h_i,p
  template <class T>
  T compensation(const std::vector<T>& x, const std::vector<T>& theta, bool fields_alone = false) const {
    T sum = constant<T>(0);
    for (std::size_t m = 0; m < x.size() / 2; ++m) {
      const std::vector<T> h_q = slopes(x, theta, m, fields_alone);
      const std::vector<T> h_p = slopes(x, theta, m + x.size() / 2, fields_alone);
      for (std::size_t i = 0; i < h_q.size(); ++i) sum += h_q[i] * h_p[i];
    }
    return constant<T>(0.25) * sum;
  }

  // ---- the same in numbers

  Eigen::VectorXd potentials(const PhaseState& state) const { return vector(potentials(coordinates(state), theta())); }
  PhaseState gradient(const PhaseState& state, const Eigen::VectorXd& w, bool fields_alone = false) const {
    return each([&](std::size_t m) { return vector(slopes(coordinates(state), theta(), m, fields_alone)).dot(w); });
  }
  PhaseState hessian(const PhaseState& state, const Eigen::VectorXd& w, const PhaseState& change) const {
    const auto x = moved(coordinates(state), coordinates(change));
    return each([&](std::size_t m) { return change_of(slopes(x, at_rest(theta()), m)).dot(w); });
  }
  PhaseState gradient_by_parameters(const PhaseState& state, const Eigen::VectorXd& w,
                                    const Eigen::VectorXd& change) const {
    const auto by = moved(theta(), {change.begin(), change.end()});
    return each([&](std::size_t m) { return change_of(slopes(at_rest(coordinates(state)), by, m)).dot(w); });
  }

  PhaseState compensation_gradient(const PhaseState& state, bool fields_alone = false) const {
    const std::vector<double> x = coordinates(state);
    return each(
        [&](std::size_t m) { return compensation(moved(x, unit(x.size(), m)), at_rest(theta()), fields_alone).v[0]; });
  }
  PhaseState compensation_hessian(const PhaseState& state, const PhaseState& change) const {
    const auto x = moved(coordinates(state), coordinates(change));
    return each(
        [&](std::size_t m) { return compensation(moved(x, unit(x.size(), m)), at_rest(at_rest(theta()))).v[0].v[0]; });
  }
  PhaseState compensation_by_parameters(const PhaseState& state, const Eigen::VectorXd& change) const {
    const auto x = at_rest(coordinates(state));
    const auto by = at_rest(moved(theta(), {change.begin(), change.end()}));
    return each([&](std::size_t m) { return compensation(moved(x, unit(x.size(), m)), by).v[0].v[0]; });
  }

  double friction() const { return friction_by_parameters(vector(theta())); }
  double friction_by_parameters(const Eigen::VectorXd& change) const {
    const std::vector<std::string> all = names();
    double sum = 0;
    for (std::size_t i = 0; i < all.size(); ++i)
      if (all[i] == "friction") sum += change[i];
    return sum;
  }

 private:
  struct Term {
    std::string name;
    std::string fields;
    bool common;
    std::vector<int> on;
    std::vector<std::vector<double>> centres;
    std::vector<std::vector<int>> screens;  // which landmarks screen each
    std::vector<std::pair<std::string, double>> theta;
  };

  Term read(const Spec& spec, const Landmarks& shape) const {
    const auto text = [&](const std::string& key, const std::string& otherwise) {
      const auto found = spec.values.find(key);
      return found == spec.values.end() ? otherwise : found->second;
    };
    Term term;
    term.name = spec.name;
    term.fields = text("fields", "constant");
    term.common = text("common", "0") == "1";
    for (int a = 0; a < n_; ++a)
      if (text("on", "all") == "all" ||
          ("/" + text("on", "") + "/").find("/" + std::to_string(a + 1) + "/") != std::string::npos)
        term.on.push_back(a);
    if (term.name == "p-sd") term.centres = centres(term, text("center", ""), std::stoi(text("count", "4")), shape);
    if (term.name == "ch-sd-screened") term.screens = screens(shape);
    for (const std::string& name : fitted(term)) {
      const std::string value = text(name, name == "width" ? "auto" : "1");
      term.theta.emplace_back(name, value == "auto" ? automatic_width(term, shape) : std::stod(value));
    }
    return term;
  }

  static std::vector<std::string> fitted(const Term& term) {
    if (term.name == "none") return {};
    if (term.name == "ch-sd" || term.name == "linear") return {"beta"};
    if (term.name == "ch-sd-screened" || term.name == "potential") return {"beta", "gamma"};
    if (term.name == "trouve-vialard") return {"sigma"};
    if (term.name == "kunita") return {"beta", "width"};
    if (term.name == "langevin") return {"sigma", "friction"};
    if (term.name == "p-sd" && term.fields == "constant") return {"beta"};
    if (term.name == "p-sd" && term.fields == "cos") return {"beta", "wavenumber"};
    if (term.name == "p-sd" && (term.fields == "grid" || term.fields == "bump")) return {"beta", "width"};
    throw std::logic_error("noise '" + term.name + "' has no definition in the tests");
  }

  // b screens a: one of another group, or of one group each other one.
  std::vector<std::vector<int>> screens(const Landmarks& shape) const {
    const auto& group = shape.groups;
    const bool several = std::any_of(group.begin(), group.end(), [&](const auto& g) { return g != group.front(); });
    std::vector<std::vector<int>> of(n_);
    for (int a = 0; a < n_; ++a)
      for (int b = 0; b < n_; ++b)
        if (several ? group[a] != group[b] : a != b) of[a].push_back(b);
    return of;
  }

  std::vector<std::vector<double>> centres(const Term& term, const std::string& given, int count,
                                           const Landmarks& shape) const {
    std::vector<std::vector<double>> all;
    if (term.fields == "bump") {
      std::istringstream numbers(given);
      for (std::string number; std::getline(numbers, number, '/');) {
        if (all.empty() || std::ssize(all.back()) == d_) all.emplace_back();
        all.back().push_back(std::stod(number));
      }
    }
    if (term.fields == "grid") {
      all = {{}};
      for (int j = d_ - 1; j >= 0; --j) all = with_ticks(all, shape.points.row(j), count);
    }
    return all;
  }

  // Every tick between the lowest and the highest number, in front of every centre.
  static std::vector<std::vector<double>> with_ticks(const std::vector<std::vector<double>>& centres,
                                                     const Eigen::RowVectorXd& row, int count) {
    const double low = row.minCoeff();
    const double step = count > 1 ? (row.maxCoeff() - low) / (count - 1) : 0;
    std::vector<std::vector<double>> all;
    for (const auto& centre : centres) {
      for (int i = 0; i < (step > 0 ? count : 1); ++i) {
        all.push_back({step > 0 ? low + i * step : (low + row.maxCoeff()) / 2});
        all.back().insert(all.back().end(), centre.begin(), centre.end());
      }
    }
    return all;
  }

  // The spacing of the grid, else a quarter of the largest distance of two landmarks.
  double automatic_width(const Term& term, const Landmarks& shape) const {
    const auto vector_of = [](const auto& x) { return Eigen::Map<const Eigen::VectorXd>(x.data(), x.size()); };
    double nearest = std::numeric_limits<double>::infinity();
    for (const auto& a : term.centres)
      for (const auto& b : term.centres)
        if (a != b) nearest = std::min(nearest, (vector_of(a) - vector_of(b)).norm());
    if (term.fields == "grid" && std::isfinite(nearest)) return nearest;
    double widest = 0;
    for (int a = 0; a < n_; ++a)
      for (int b = 0; b < n_; ++b) widest = std::max(widest, (shape.points.col(a) - shape.points.col(b)).norm());
    return term.name == "kunita" && widest == 0 ? 1 : widest / 4;
  }

  // ---- potentials, one function for each model

  template <class T>
  std::vector<T> potentials_of(const Term& term, const Coordinates<T>& at, const std::vector<T>& theta) const {
    if (term.name == "none") return {};
    if (term.name == "ch-sd") return ch_sd(term, at, theta);
    if (term.name == "ch-sd-screened") return ch_sd_screened(term, at, theta);
    if (term.name == "p-sd") return p_sd(term, at, theta);
    if (term.name == "trouve-vialard" || term.name == "langevin") return trouve_vialard(term, at, theta);
    if (term.name == "potential") return potential(term, at, theta);
    if (term.name == "kunita") return kunita(at, theta);
    if (term.name == "linear") return linear(at, theta);
    throw std::logic_error("noise '" + term.name + "' has no definition in the tests");
  }

  template <class T>
  std::vector<T> ch_sd(const Term& term, const Coordinates<T>& at, const std::vector<T>& theta) const {
    std::vector<T> h;
    for (const int a : term.on)
      for (int j = 0; j < d_; ++j) h.push_back(theta[0] * at.p(a, j));
    return h;
  }

  template <class T>
  std::vector<T> ch_sd_screened(const Term& term, const Coordinates<T>& at, const std::vector<T>& theta) const {
    using std::exp;
    std::vector<T> h;
    for (const int a : term.on) {
      T screen = constant<T>(0);
      for (const int b : term.screens[a]) screen += exp(-at.squared_distance(a, b) * inverse(theta[1]));
      for (int j = 0; j < d_; ++j) h.push_back(theta[0] * at.p(a, j) * screen);
    }
    return h;
  }

  template <class T>
  std::vector<T> trouve_vialard(const Term& term, const Coordinates<T>& at, const std::vector<T>& theta) const {
    std::vector<T> h;
    for (const int a : term.on)
      for (int j = 0; j < d_; ++j) h.push_back(theta[0] * at.q(a, j));
    return term.common ? shared(h, d_) : h;
  }

  template <class T>
  std::vector<T> potential(const Term& term, const Coordinates<T>& at, const std::vector<T>& theta) const {
    using std::exp;
    std::vector<T> h;
    for (int b = 0; b < n_; ++b)
      for (int a = 0; a < b; ++a) h.push_back(theta[0] * exp(-at.squared_distance(a, b) * inverse(theta[1])));
    return term.common ? shared(h, 1) : h;
  }

  template <class T>
  std::vector<T> kunita(const Coordinates<T>& at, const std::vector<T>& theta) const {
    using std::exp;
    std::vector<T> h;
    for (int b = 0; b < n_; ++b)
      for (int j = 0; j < d_; ++j) {
        h.push_back(constant<T>(0));
        for (int a = 0; a < at.n; ++a)
          h.back() += theta[0] * at.p(a, j) * exp(-at.squared_distance(a, b) * inverse(theta[1] * theta[1]));
      }
    return h;
  }

  template <class T>
  std::vector<T> linear(const Coordinates<T>& at, const std::vector<T>& theta) const {
    std::vector<T> h;
    for (int k = 0; k < d_; ++k) {
      for (int j = 0; j < d_; ++j) {
        h.push_back(constant<T>(0));
        for (int a = 0; a < at.n; ++a) h.back() += theta[0] * at.p(a, j) * at.q(a, k);
      }
    }
    return h;
  }

  template <class T>
  std::vector<T> p_sd(const Term& term, const Coordinates<T>& at, const std::vector<T>& theta) const {
    std::vector<T> h;
    for (int a = 0; a < at.n; ++a) {
      const std::vector<T> phi = fields_at(term, at, a, theta);
      h.resize(phi.size() * d_, constant<T>(0));
      for (std::size_t i = 0; i < h.size(); ++i) h[i] += theta[0] * phi[i / d_] * at.p(a, static_cast<int>(i % d_));
    }
    return h;
  }

  // φ(q_a) for each scalar field φ
  template <class T>
  std::vector<T> fields_at(const Term& term, const Coordinates<T>& at, int a, const std::vector<T>& theta) const {
    using std::cos;
    using std::exp;
    std::vector<T> phi;
    if (term.fields == "constant") phi.push_back(constant<T>(1));
    if (term.fields == "cos")
      for (int j = 0; j < d_; ++j) phi.push_back(cos(theta[1] * at.q(a, j)));
    for (const auto& centre : term.centres) {
      T squared = constant<T>(0);
      for (int j = 0; j < d_; ++j) {
        const T z = at.q(a, j) - constant<T>(centre[j]);
        squared += z * z;
      }
      phi.push_back(exp(-squared * inverse(theta[1] * theta[1])));
    }
    return phi;
  }

  template <class T>
  static std::vector<T> shared(const std::vector<T>& h, int channels) {
    std::vector<T> sums(channels, constant<T>(0));
    for (std::size_t i = 0; i < h.size(); ++i) sums[i % channels] += h[i];
    return sums;
  }

  template <class T>
  static std::vector<ceres::Jet<T, 1>> at_rest(const std::vector<T>& x) {
    return moved(x, std::vector<double>(x.size(), 0));
  }
  static Eigen::VectorXd vector(const std::vector<double>& x) {
    return Eigen::Map<const Eigen::VectorXd>(x.data(), static_cast<Eigen::Index>(x.size()));
  }
  static Eigen::VectorXd change_of(const std::vector<ceres::Jet<double, 1>>& x) {
    Eigen::VectorXd change(static_cast<Eigen::Index>(x.size()));
    for (Eigen::Index i = 0; i < change.size(); ++i) change[i] = x[i].v[0];
    return change;
  }
  // The derivatives by all coordinates as (q part, p part).
  template <class Slope>
  PhaseState each(const Slope& slope) const {
    const int n = n_ + tracers_;
    PhaseState all{Points(d_, n), Points(d_, n)};
    for (int m = 0; m < d_ * n; ++m) {
      all.q(m) = slope(m);
      all.p(m) = slope(m + d_ * n);
    }
    return all;
  }

  int d_;
  int n_;
  int tracers_ = 0;  // behind the landmarks
  std::vector<Term> terms_;
};

}  // namespace pulson
