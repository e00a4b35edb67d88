#pragma once

// Files in archives of zip: those of ImageJ's RoiSet.zip and of numpy's npz.

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

namespace pulson::formats {

struct ZipEntry {
  std::string name;
  std::uint16_t method = 0;  ///< 0: stored, 8: deflated
  std::uint32_t crc = 0;
  std::size_t size = 0;       ///< as the archive says
  std::string_view packed{};  ///< within the archive
};

/// Whether bytes begin as an archive does.
bool is_zip(std::string_view bytes);

/// The files of an archive in the order of its directory, without folders; nothing where it is broken.
std::vector<ZipEntry> zip_entries(std::string_view bytes);

/// The contents of a file, of at most as many bytes as the archive says. @throws InputError "path: NAME ..." where they
/// are broken, packed in another way, or longer than kMostText
std::string unpacked(const std::string& path, const ZipEntry& entry);

}  // namespace pulson::formats
