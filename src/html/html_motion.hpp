#pragma once

#include <string>

#include "html/html_report.hpp"

namespace pulson::html {

/// The motion as a figure: a canvas, a slider, and the numbers as JSON, which page/motion.js draws. Places are whole
/// numbers of units of a hundred thousandth of the box that holds all. @throws InputError where sizes disagree or a
/// number is not finite
std::string motion(const ReportMotion& motion);

/// Two pictures over one another, which page/stack.js mixes. @throws InputError as data_address does
std::string stack(const ReportStack& stack);

}  // namespace pulson::html
