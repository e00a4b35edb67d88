#include "open_model.hpp"

#include <fmt/core.h>

#include "matching/defaults.hpp"
#include "matching/starting_values.hpp"
#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

// The value of an option, or where it is fitted the starting value, by default `usual`.
std::string take_open(const std::string& text, const std::string& option, const std::string& name,
                      const std::string& usual, std::vector<OpenNumber>& open) {
  std::optional<OpenNumber> number = OpenNumber::parse(text, option);
  if (!number) return text;
  number->name = name;
  open.push_back(*number);
  return number->start.empty() ? usual : number->start;
}

}  // namespace

OpenModel::OpenModel(const std::string& kernel, const std::string& noise, const std::string& sigma,
                     const std::string& lambda)
    : kernel_(OpenSpec::parse(kernel, "kernel")), noise_(OpenSpec::parse(noise, "noise")), open_(kernel_.open) {
  require_numbers(noise_, noise_table());
  open_.insert(open_.end(), noise_.open.begin(), noise_.open.end());
  const matching::TaskDefaults& usual = matching::register_defaults();
  sigma_ = Length::parse(take_open(sigma, "--sigma", "data-sigma", usual.sigma.value, open_), "--sigma");
  if (!(sigma_.in(1) > 0)) throw InputError(fmt::format("--sigma is {}; it must be greater than 0", sigma));
  const std::string weight = take_open(lambda, "--lambda", "lambda", usual.lambda.value, open_);
  if (weight != "auto") lambda_ = parse_number(weight, "--lambda");
}

std::vector<std::string> OpenModel::names() const {
  std::vector<std::string> names;
  for (const OpenNumber& number : open_) names.push_back(number.name);
  return names;
}

std::vector<std::string> OpenModel::priors() const {
  std::vector<std::string> priors;
  for (const OpenNumber& number : open_)
    priors.push_back(number.log_deviation ? fmt::format("{}={}", number.name, *number.log_deviation) : number.name);
  return priors;
}

void OpenModel::set(matching::RegistrationOptions& options) const {
  options.kernel = kernel_.text;
  options.sigma = sigma_;
  options.lambda = lambda_;
  options.noise = noise_.text;
}

void OpenModel::set_noise(const Landmarks& source, const std::vector<Landmarks>& targets,
                          matching::RegistrationOptions& options) const {
  options.noise = with_starting_values(noise_, source, targets, options);
}

bool is_fitted(std::string_view option, const std::string& text) {
  if (text == "auto")
    throw InputError(fmt::format("{} is 'auto'; a number is needed, or fit where it is to be fitted", option));
  const std::optional<OpenNumber> number = OpenNumber::parse(text, option);
  if (number && (!number->start.empty() || number->log_deviation))
    throw InputError(fmt::format("{} is {}; here it is fitted from its own starting value and without a prior: fit",
                                 option, quoted_line(text)));
  return number.has_value();
}

}  // namespace pulson
