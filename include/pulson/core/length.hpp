#pragma once

#include <string>
#include <string_view>

namespace pulson {

/// A length in the units of the coordinates, or in per cent of a shape's diameter, which does not depend on the unit.
class Length {
 public:
  Length(double value) : value_(value) {}  // NOLINT(google-explicit-constructor): a number is a length
  static Length percent(double value);

  /// `0.5%` or `0.3`. @throws InputError that begins with `what`
  static Length parse(std::string_view text, std::string_view what);

  bool is_relative() const { return relative_; }
  /// In the units of the coordinates. @param diameter of the shape, in the same units
  double in(double diameter) const { return relative_ ? value_ / 100 * diameter : value_; }
  /// As parse() reads it.
  std::string text() const;

 private:
  double value_ = 0;  // length units, or per cent
  bool relative_ = false;
};

}  // namespace pulson
