#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "html/html_report.hpp"
#include "record.hpp"

namespace pulson {

/// @param paths, chains the pictures; empty: none
html::HtmlReport sample_report(const PosteriorResults& results, const std::filesystem::path& paths,
                               const std::filesystem::path& chains);

html::HtmlReport calibration_report(const inference::PosteriorProblem& problem,
                                    const inference::Calibration& calibration, const std::vector<std::string>& notes,
                                    const std::filesystem::path& picture);

/// The larger Pareto k of the weights, or "undefined".
std::string pareto_text(const inference::PosteriorDraws& draws);

/// "by weighted draws: log p(y) = 12.34 ± 0.05, means within 2.1 standard errors", or that nothing does.
std::string confirmation_text(const inference::PosteriorDraws& draws);

/// "ch-sd:beta=0.1, gaussian:alpha=0.5, lambda 2.3, sigma 0.01, heun in 20 steps"
std::string model_words(const inference::PosteriorProblem& problem);

}  // namespace pulson
