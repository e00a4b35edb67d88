#include <cstddef>

#include "file_checks.hpp"

namespace pulson::images {
namespace {

unsigned byte_at(std::string_view bytes, std::size_t at) { return static_cast<unsigned char>(bytes[at]); }

bool is_restart(unsigned marker) { return marker >= 0xD0 && marker <= 0xD7; }

}  // namespace

bool is_cut_jpeg(std::string_view bytes) {
  constexpr unsigned kScan = 0xDA, kEnd = 0xD9;
  if (!bytes.starts_with("\xFF\xD8\xFF")) return false;
  bool is_in_scan = false;
  for (std::size_t i = 2; i + 1 < bytes.size();) {
    const unsigned marker = byte_at(bytes, i + 1);
    // In a scan 0xFF 0 stands for the byte 0xFF; between segments there may be filling bytes 0xFF.
    const bool is_marker = byte_at(bytes, i) == 0xFF && marker != 0 && marker != 0xFF && !is_restart(marker);
    if (!is_marker) {
      // What is between segments and no mark is a damaged file: its end is not to be found by lengths any more.
      if (!is_in_scan && byte_at(bytes, i) != 0xFF) return false;
      ++i;
    } else if (marker == kEnd) {
      return false;
    } else {
      if (i + 3 >= bytes.size()) return true;
      is_in_scan = marker == kScan;
      i += 2 + 256 * byte_at(bytes, i + 2) + byte_at(bytes, i + 3);
    }
  }
  return true;
}

}  // namespace pulson::images
