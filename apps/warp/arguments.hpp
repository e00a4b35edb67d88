#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <CLI/App.hpp>

#include "pulson/images/warp_image.hpp"
#include "pulson/warp/material_flow.hpp"
#include "shell/options.hpp"

namespace pulson {

/// The command line of `pulson warp`.
struct WarpArguments {
  std::string registration;
  std::string input;
  std::string out;
  std::string json;
  bool inverse = false;
  std::string labels = "metric";
  formats::ReadOptions reading;

  // frames
  std::string like;  ///< an image that has the target's size
  std::string size;  ///< W×H
  std::optional<double> pixel_size;
  std::optional<double> target_pixel_size;
  std::string origin;         ///< x,y
  std::string target_origin;  ///< x,y
  std::optional<bool> flip_y;

  // the picture
  std::string method = "auto";
  std::string over = "least-stretched";
  std::string interpolation = "linear";
  std::string border = "auto";
  std::string background;
  int supersampling = 2;
  double tolerance = 0.05;
  std::int64_t max_pixels = images::kMaxPixels;

  // what else is written
  std::string field;
  std::optional<int> grid_points;  ///< of a field in space
  std::string jacobian;
  std::string log_jacobian;
  std::string multiplicity;
  std::string folds;
  std::string holes;
  std::string grid;
  std::string side_by_side;
  std::string overlay;
  std::string report;
  std::string displacement;
  bool numbers = false;         ///< beside the landmarks of drawings
  std::optional<double> width;  ///< of drawings, mm
  double dpi = 96;              ///< of png drawings
  std::string animate;

  // ensembles
  int samples = 0;
  std::uint64_t seed = 1;
  std::string deviation;
  std::string fold_probability;

  void add_to(CLI::App& verb);
  /// All that can be known to fail before the work is done. @throws InputError
  void check() const;
  /// What is for images alone. @throws InputError
  void check_for_landmarks() const;
  /// What --inverse cannot compute where the map has no inverse. @throws InputError
  void check_for_fold() const;

  images::WarpMethod warp_method() const;
  /// "640x480"
  std::optional<std::pair<int, int>> canvas() const;
  /// "-2,-1.5"
  std::optional<std::array<double, 2>> origin_of_image() const;
  std::optional<std::array<double, 2>> origin_of_result() const;
};

}  // namespace pulson
