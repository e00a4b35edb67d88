#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace pulson::images {

/// Whether the bytes are of a jpg that ends before its end mark. OpenCV takes such a file and makes up the rest.
bool is_cut_jpeg(std::string_view bytes);

/// What OpenCV 4.6 does not detect about a tif.
struct TiffFacts {
  std::string unreadable;         ///< why OpenCV would silently read wrong pixels; else empty
  bool is_premultiplied = false;  ///< OpenCV gives colours multiplied by alpha
};

/// Nothing where the bytes are no tif, or one whose tags cannot be followed: then libtiff is left to say so.
std::optional<TiffFacts> tiff_facts(std::string_view bytes);

}  // namespace pulson::images
