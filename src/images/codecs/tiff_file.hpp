#pragma once

// What the readers and writers of tif share: libtiff on a file in memory, and what a tag holds.

#include <algorithm>
#include <memory>
#include <string>
#include <string_view>

#include <tiffio.h>

#include "pulson/images/pages.hpp"

namespace pulson::images {

/// What is read, or is being written, by functions that read, write and seek.
struct MemoryFile {
  std::string_view bytes;
  std::string written;
  std::size_t position = 0;

  std::size_t size() const { return std::max(bytes.size(), written.size()); }
};

using Tiff = std::unique_ptr<TIFF, decltype(&TIFFClose)>;

/// @param most bytes of a block that libtiff allocates for what the file claims; 0: no limit
Tiff open_tiff(MemoryFile& file, const char* mode, tmsize_t most = 0);

template <class Value>
Value field(TIFF* tif, unsigned tag) {
  Value value{};
  TIFFGetFieldDefaulted(tif, tag, &value);
  return value;
}

/// What the current page says beside its pixels, but for its kind of colours.
void read_tags(TIFF* tif, PageMetadata& about);

/// The same for the page that is being written.
void write_tags(TIFF* tif, const PageMetadata& about);

}  // namespace pulson::images
