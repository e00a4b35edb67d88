#include "core/paths.hpp"

#include <filesystem>
#include <fstream>
#include <string>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/stat.h>
#include <sys/un.h>
#include <unistd.h>

#include "error_of.hpp"
#include "temporary_folder.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using Paths = InTemporaryFolder;

void make_socket(const char* name) {
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::string(name).copy(address.sun_path, sizeof address.sun_path - 1);
  const int socket = ::socket(AF_UNIX, SOCK_STREAM, 0);
  ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ::close(socket);
}

TEST_F(Paths, HaveOneKindEach) {
  write("file", "text");
  fs::create_directory("folder");
  ASSERT_EQ(::mkfifo("pipe", 0600), 0);
  make_socket("socket");
  fs::create_symlink("file", "link");
  fs::create_symlink("missing", "dangling");
  fs::create_symlink("dangling", "dangling_2");
  fs::create_symlink("loop", "loop");
  EXPECT_EQ(kind_of("file"), PathKind::kFile);
  EXPECT_EQ(kind_of("link"), PathKind::kFile);
  EXPECT_EQ(kind_of("folder"), PathKind::kFolder);
  EXPECT_EQ(kind_of("pipe"), PathKind::kPipe);
  EXPECT_EQ(kind_of("socket"), PathKind::kSocket);
  EXPECT_EQ(kind_of("/dev/zero"), PathKind::kDevice);
  EXPECT_EQ(kind_of("missing"), PathKind::kMissing);
  EXPECT_EQ(kind_of("file/below"), PathKind::kMissing);
  EXPECT_EQ(kind_of(""), PathKind::kMissing);
  EXPECT_EQ(kind_of("dangling_2"), PathKind::kDanglingLink);
  EXPECT_EQ(kind_of("loop"), PathKind::kLinkLoop);
  EXPECT_EQ(kind_of(std::string(300, 'n')), PathKind::kNameTooLong);
  EXPECT_EQ(kind_of(std::string(5000, 'n')), PathKind::kNameTooLong);
  EXPECT_EQ(kind_of(std::string("file\0", 5)), PathKind::kUnreadable);
}

TEST_F(Paths, ThatAreNoFilesAreNotRead) {
  fs::create_directory("folder");
  ASSERT_EQ(::mkfifo("pipe", 0600), 0);
  make_socket("socket");
  fs::create_symlink("missing", "dangling");
  fs::create_symlink("loop", "loop");
  const auto error = [](const fs::path& path) { return error_of([&] { read_file(path); }); };
  EXPECT_EQ(error("folder"), "cannot read 'folder': it is a folder; a file is needed");
  EXPECT_EQ(error("pipe"), "cannot read 'pipe': it is a named pipe; a file is needed");
  EXPECT_EQ(error("socket"), "cannot read 'socket': it is a socket; a file is needed");
  EXPECT_EQ(error("/dev/zero"), "cannot read '/dev/zero': it is a device; a file is needed");
  EXPECT_EQ(error("missing"), "cannot read 'missing': No such file or directory");
  EXPECT_EQ(error("dangling"), "cannot read 'dangling': it is a link to 'missing', which is missing");
  EXPECT_EQ(error("loop"), "cannot read 'loop': its links form a loop");
  EXPECT_EQ(error(std::string(300, 'n')), "cannot read '" + std::string(60, 'n') + "…" + std::string(60, 'n') +
                                              "' (300 bytes): the name is too long");
}

TEST_F(Paths, AreReadUpToALimit) {
  write("file", "0123456789");
  EXPECT_EQ(read_file("file", 10), "0123456789");
  EXPECT_EQ(error_of([] { read_file("file", 9); }), "cannot read 'file': it holds more than 9 bytes");
  fs::resize_file("file", kMostBytes + 1);  // takes no room on the disk
  EXPECT_EQ(error_of([] { read_file("file"); }), "cannot read 'file': it holds more than 4 GiB");
  EXPECT_FALSE(read_file("/proc/self/status").empty());  // says that it is 0 bytes long
}

TEST_F(Paths, OfOwnPipesAreRead) {
  int ends[2];
  ASSERT_EQ(::pipe(ends), 0);
  ASSERT_EQ(::write(ends[1], "text", 4), 4);
  ::close(ends[1]);
  const std::string path = "/dev/fd/" + std::to_string(ends[0]);
  EXPECT_EQ(read_file(path), "text");
  EXPECT_EQ(read_file(path), "text") << "the second time";
  ::close(ends[0]);
}

TEST_F(Paths, OfEndlessInputEndAtTheLimit) {
  const int zero = ::open("/dev/zero", O_RDONLY);
  EXPECT_EQ(error_of([&] { read_descriptor(zero, "standard input", 1 << 20); }),
            "cannot read standard input: it holds more than 1 MiB");
  ::close(zero);
}

TEST_F(Paths, AreTheSameThroughLinks) {
  fs::create_directory("folder");
  write("file", "text");
  fs::create_symlink("file", "link");
  fs::create_symlink("folder", "folder_link");
  fs::create_symlink("folder/new", "link_to_new");
  fs::create_hard_link("file", "hard");
  fs::create_symlink("loop", "loop");
  const auto file = identity_of("file");
  ASSERT_TRUE(file);
  for (const char* same : {"link", "hard", "./file", "folder/../file", "folder_link/../link"})
    EXPECT_EQ(identity_of(same), file) << same;
  EXPECT_EQ(identity_of(fs::absolute("file")), file);
  const auto made = identity_of("folder/new");
  ASSERT_TRUE(made);
  for (const char* same : {"folder_link/new", "link_to_new", "folder/./new"})
    EXPECT_EQ(identity_of(same), made) << same;
  EXPECT_NE(made, file);
  EXPECT_NE(identity_of("folder/New"), made);
  EXPECT_EQ(identity_of("no/a/b"), identity_of("no/../no/a/b"));
  EXPECT_FALSE(identity_of("loop"));
}

}  // namespace
}  // namespace pulson
