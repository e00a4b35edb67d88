#pragma once

// Numbers of motions as JSON: places are whole numbers of units of a hundred thousandth of the box that holds all.

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

#include "draw/layers.hpp"
#include "html_parts.hpp"

namespace pulson::html {

// The box of all that is drawn, and the length of a unit in it.
struct Box {
  Eigen::VectorXd low, high;
  double unit = 1;

  void include(const Points& points) {
    if (points.cols() == 0) return;
    if (const auto [from, to] = bounding_box(points); from.allFinite() && to.allFinite()) {
      low = low.cwiseMin(from);
      high = high.cwiseMax(to);
    }
  }
};

class Json {
 public:
  explicit Json(const Box& box) : box_(box) {}

  // "name":value,
  template <typename Value>
  void add(std::string_view name, const Value& value) {
    fmt::format_to(std::back_inserter(text_), "\"{}\":{},", name, value);
  }

  // Places in units, landmark by landmark.
  void add_points(std::string_view name, const Points& points) {
    fmt::format_to(std::back_inserter(text_), "\"{}\":", name);
    append(points);
    text_ += ',';
  }

  void add_frames(std::string_view name, const std::vector<Points>& frames) {
    fmt::format_to(std::back_inserter(text_), "\"{}\":[", name);
    for (const Points& frame : frames) {
      append(frame);
      text_ += ',';
    }
    end_list();
  }

  void add_paths(std::string_view name, const std::vector<std::vector<Points>>& paths) {
    fmt::format_to(std::back_inserter(text_), "\"{}\":[", name);
    for (const std::vector<Points>& path : paths) {
      text_ += '[';
      for (const Points& frame : path) {
        append(frame);
        text_ += ',';
      }
      end_list();
    }
    end_list();
  }

  // Terms of a polynomial whose values are places, the constant one first: tenths of units.
  void add_terms(std::string_view name, const std::vector<Points>& terms) {
    fmt::format_to(std::back_inserter(text_), "\"{}\":[", name);
    for (std::size_t t = 0; t < terms.size(); ++t) {
      text_ += '[';
      for (Eigen::Index a = 0; a < terms[t].cols(); ++a)
        for (Eigen::Index axis = 0; axis < terms[t].rows(); ++axis)
          fmt::format_to(std::back_inserter(text_), "{:.1f},",
                         (terms[t](axis, a) - (t == 0 ? box_.low[axis] : 0)) / box_.unit);
      end_list();
    }
    end_list();
  }

  // Lines through landmarks and links between two: lists of their numbers from 0, the first again at the end of a
  // closed one.
  void add_outlines(std::string_view name, const draw::Figure& figure) {
    fmt::format_to(std::back_inserter(text_), "\"{}\":[", name);
    for (const draw::Outline& outline : figure.outlines)
      fmt::format_to(std::back_inserter(text_), "[{}],", fmt::join(outline.members, ","));
    for (const draw::Link& link : figure.links)
      fmt::format_to(std::back_inserter(text_), "[{},{}],", link.from, link.to);
    end_list();
  }

  const Box& box() const { return box_; }

  std::string finished() && {
    text_.pop_back();
    return "{" + text_ + "}";
  }

 private:
  void end_list() {
    if (text_.back() == ',') text_.pop_back();
    text_ += "],";
  }

  void append(const Points& points) {
    text_ += '[';
    for (Eigen::Index a = 0; a < points.cols(); ++a)
      for (Eigen::Index axis = 0; axis < points.rows(); ++axis) {
        if (const double place = points(axis, a); std::isnan(place))
          text_ += "null,";
        else
          fmt::format_to(std::back_inserter(text_), "{:.0f},", (place - box_.low[axis]) / box_.unit);
      }
    if (text_.back() == ',') text_.pop_back();
    text_ += ']';
  }

  const Box& box_;
  std::string text_;
};

/// The box of all that a motion shows. @throws InputError where it is too large to be shown
Box box_of(const ReportMotion& motion);

/// Adds what page/motion.js needs: the first `frames` of the motion.
void add_motion(const ReportMotion& motion, std::size_t frames, Json& json);

/// @throws InputError where sizes of a motion disagree or a number is not finite
void check_sizes(const ReportMotion& motion);

/// The key of a motion, whose entries switch their layers.
std::string key_of(const ReportMotion& motion);

/// Buttons that zoom.
std::string zoom_buttons();

/// The text with what would end a string of JSON, or the script, escaped.
void append_json_text(std::string& json, const std::string& text);

}  // namespace pulson::html
