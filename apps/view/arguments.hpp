#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pulson/images/image.hpp"
#include "shell/options.hpp"

namespace pulson {

/// The command line of `pulson view`.
struct ViewArguments {
  std::vector<std::string> files;  ///< pictures, landmark files, or one file of an earlier session
  formats::ReadOptions reading;
  int port = 0;
  bool no_browser = false;
  bool in_place = false;
  std::int64_t max_pixels = images::kMaxPixels;

  void add_to(CLI::App& verb);
};

}  // namespace pulson
