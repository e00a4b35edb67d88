#pragma once

// What paths name, and the reading of whole files. Paths come from users and from data: nothing here that only looks at
// a path throws.

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <utility>

#include <sys/types.h>

namespace pulson {

/// What a path names once its links are followed.
enum class PathKind {
  kFile,
  kFolder,
  kPipe,
  kSocket,
  kDevice,
  kMissing,
  kDanglingLink,  ///< a link to what is missing
  kLinkLoop,
  kNameTooLong,
  kForbidden,   ///< a folder on the way may not be searched
  kUnreadable,  ///< another fault of the path or the disk
};

PathKind kind_of(const std::filesystem::path& path) noexcept;
bool is_file(const std::filesystem::path& path) noexcept;
bool is_folder(const std::filesystem::path& path) noexcept;
/// Whether a file, folder, pipe, socket or device is there.
bool is_there(const std::filesystem::path& path) noexcept;

/// Why `path` is no file that can be read or written: "it is a folder; a file is needed". Empty for a file, and for
/// what is missing.
std::string why_no_file(const std::filesystem::path& path);

/// `path` in quotes, the middle of a very long one left out.
std::string quoted_path(const std::filesystem::path& path);

/// Where what is written to `path` arrives: links are followed to the end, also those to what is missing. `path` itself
/// where they form a loop.
std::filesystem::path behind_links(const std::filesystem::path& path);

/// Equal for two paths of one file, through links, hard links, "." and "..", and for two paths at which one file would
/// be made.
struct FileIdentity {
  dev_t device = 0;  ///< of the file; where it is missing, of the last folder that is there
  ino_t node = 0;
  std::string rest{};  ///< the path from that folder on; empty where the file is there
  bool operator==(const FileIdentity&) const = default;
};

/// Removes the file that is there, if one is.
void remove_quietly(const std::filesystem::path& path) noexcept;

/// None where nothing can be known, as of a link loop.
std::optional<FileIdentity> identity_of(const std::filesystem::path& path);

// The largest files, in bytes, so that one without an end, or one of another kind, is refused before memory is full.

/// Of parts of ensembles, surfaces and grids: the largest that the program writes holds 4e8 numbers, 3.2 GB.
inline constexpr std::uint64_t kMostBytes = 4ULL << 30;
/// Of text: 2e7 landmarks in space with 16 digits a coordinate.
inline constexpr std::uint64_t kMostText = 1ULL << 30;
/// Of standard input and pipes, which do not say how long they are.
inline constexpr std::uint64_t kMostPiped = 256ULL << 20;

/// All of a regular file, or of a pipe without a name in a folder: /dev/stdin, /dev/fd/63 of a shell's `<(command)`,
/// which is read once and kept.
/// @throws InputError "cannot read 'path': reason" for all else, and if it holds more than `most` bytes
std::string read_file(const std::filesystem::path& path, std::uint64_t most = kMostBytes);

/// All that can be read from an open descriptor; `name` as messages call it. @throws InputError, also where it holds
/// more than `most` bytes
std::string read_descriptor(int descriptor, const std::string& name, std::uint64_t most);

}  // namespace pulson
