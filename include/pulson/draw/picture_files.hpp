#pragma once

#include <filesystem>
#include <optional>

namespace pulson {

/// The files of a picture, all of one layout; one without a name is not written.
struct PictureFiles {
  std::filesystem::path png{};
  std::filesystem::path svg{};
  std::filesystem::path pdf{};
  std::optional<double>
      width{};      ///< mm, greater than 0; none: 25.4/96 mm for each unit of the layout, 1200 to 1600 of them
  double dpi = 96;  ///< pixels of the png per inch, greater than 0
};

}  // namespace pulson
