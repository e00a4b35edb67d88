#pragma once

#include <string>
#include <string_view>

#include "html/html_report.hpp"

namespace pulson::html {

/// The text as HTML shows it between tags and between double quotes. Control characters become spaces, bytes that are
/// not UTF-8 become U+FFFD, for a page that contains either is not valid.
std::string escaped(std::string_view text);

/// The text with U+FFFD in place of bytes that are not UTF-8.
std::string valid_utf8(std::string_view text);

/// The picture as a `data:` address. An SVG too is embedded as an image and not as part of the page: an image
/// runs no scripts and loads nothing. @throws InputError if the file cannot be read or
/// is not SVG, PNG or JPEG.
std::string data_address(const EmbeddedPicture& picture);

/// The motion as a figure: a canvas, a slider, and the numbers as JSON, which page/motion.js draws. Places are whole
/// numbers of units of a hundred thousandth of the box that holds all. @throws InputError where sizes disagree or a
/// number is not finite
std::string motion(const ReportMotion& motion);

/// The shapes as a figure, which page/space.js draws. @throws InputError where sizes disagree or a number is not finite
std::string shape_space(const ReportShapeSpace& space);

/// Two pictures over one another, which page/stack.js mixes. @throws InputError as data_address does
std::string stack(const ReportStack& stack);

}  // namespace pulson::html
