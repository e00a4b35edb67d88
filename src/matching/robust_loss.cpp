#include "pulson/matching/robust_loss.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <ceres/loss_function.h>
#include <fmt/core.h>

#include "core/landmark_pairs.hpp"
#include "core/text.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::matching {
namespace {

constexpr EnumNames<LossKind, 4> kLosses = {"loss",
                                            {{{"student", LossKind::kStudent},
                                              {"huber", LossKind::kHuber},
                                              {"cauchy", LossKind::kCauchy},
                                              {"tukey", LossKind::kTukey}}}};

// For d = 1, 2, 3. With ψ(r) = w(|r|²)r the efficiency is (E ψ·r/d)²/(E|ψ|²/d), by integration over |r| of N(0, I) and
// bisection; RobustLoss.EfficiencyIs95PerCent integrates it again.
constexpr std::array<std::array<double, 3>, 4> kEfficient = {{{7.15615, 7.87969, 8.41560},
                                                              {1.34500, 1.50114, 1.62799},
                                                              {2.38495, 2.54864, 2.66557},
                                                              {4.68507, 5.12299, 5.49025}}};

// Half of ρ' of Ceres, whose ρ(s) takes s = t² and has ρ'(0) = 1.
template <class Loss>
double weight_of(double constant, double square) {
  std::array<double, 3> rho{};
  Loss(constant).Evaluate(square, rho.data());
  return rho[1];
}

// ∫f over [low, high] by Simpson's rule.
template <class Function>
double integral(double low, double high, const Function& f) {
  constexpr int kIntervals = 400;  // errors below 1e-9 of weights that are smooth
  if (!(high > low)) return 0;
  const double step = (high - low) / kIntervals;
  double sum = f(low) + f(high);
  for (int i = 1; i < kIntervals; ++i) sum += (i % 2 == 1 ? 4 : 2) * f(low + i * step);
  return sum * step / 3;
}

}  // namespace

RobustLoss parse_loss(std::string_view text) {
  const std::size_t colon = text.find(':');
  RobustLoss loss{kLosses.parse(text.substr(0, colon)), std::nullopt};
  if (colon == std::string_view::npos) return loss;
  loss.constant = parse_number(text.substr(colon + 1), fmt::format("the constant of loss '{}'", text));
  if (!(*loss.constant > 0 && std::isfinite(*loss.constant)))
    throw InputError(fmt::format("the constant of loss '{}' must be greater than 0", text));
  return loss;
}

std::string note_of_suspects(const Landmarks& shape, const std::vector<int>& suspects) {
  return fmt::format("{}: {} {} wrong, of a weight below {}: {}", shape.source,
                     text::counted(suspects.size(), "landmark"), suspects.size() == 1 ? "looks" : "look",
                     kSuspectWeight, all_listed(shape, suspects));
}

std::string loss_spec(const RobustLoss& loss, Eigen::Index d) {
  return fmt::format("{}:{}", kLosses.name(loss.kind), loss.constant.value_or(efficient_constant(loss.kind, d)));
}

double efficient_constant(LossKind kind, Eigen::Index d) {
  return kEfficient.at(static_cast<std::size_t>(kind)).at(static_cast<std::size_t>(d - 1));
}

LossWeight::LossWeight(const RobustLoss& loss, Eigen::Index d)
    : kind_(loss.kind), constant_(loss.constant.value_or(efficient_constant(loss.kind, d))) {
  const auto dimension = static_cast<double>(d);
  if (kind_ == LossKind::kStudent) {
    consistency_ = constant_ / (constant_ + dimension);
    return;
  }
  constexpr double kFarthest = 12;  // the normal law has 1e-30 beyond
  const double scale = std::exp2(dimension / 2 - 1) * std::tgamma(dimension / 2);
  const auto moment = [&](double t) {
    return (*this)(t * t) * std::pow(t, dimension + 1) * std::exp(-t * t / 2) / scale / dimension;
  };
  const double kink = std::min(constant_, kFarthest);
  consistency_ = integral(0, kink, moment) + integral(kink, kFarthest, moment);
}

double LossWeight::operator()(double square) const {
  switch (kind_) {
    case LossKind::kStudent:
      return constant_ / (constant_ + square);
    case LossKind::kHuber:
      return weight_of<ceres::HuberLoss>(constant_, square);
    case LossKind::kCauchy:
      return weight_of<ceres::CauchyLoss>(constant_, square);
    case LossKind::kTukey:
      return weight_of<ceres::TukeyLoss>(constant_, square);
  }
  return 1;
}

}  // namespace pulson::matching
