#include <cerrno>
#include <system_error>

#include <sys/mman.h>
#include <unistd.h>

#include "fuzzing.hpp"

namespace pulson::fuzz {

MemoryFile::MemoryFile(std::string_view bytes) : descriptor_(::memfd_create("fuzz", MFD_CLOEXEC)) {
  if (descriptor_ < 0 || ::write(descriptor_, bytes.data(), bytes.size()) != static_cast<ssize_t>(bytes.size()))
    throw std::system_error(errno, std::generic_category(), "a file in memory");
}

MemoryFile::~MemoryFile() { ::close(descriptor_); }

}  // namespace pulson::fuzz
