#include "core/atomic_file.hpp"

#include <csignal>
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "temporary_folder.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using testing::StartsWith;

using AtomicFile = InTemporaryFolder;
using LockedFolder = InTemporaryFolder;
using OutputDirectory = InTemporaryFolder;

TEST_F(AtomicFile, ReplacesTheFileAndLeavesNothingElse) {
  write_file_atomically("a.txt", "first\n");
  write_file_atomically("a.txt", std::string("second\0\n", 8));
  EXPECT_EQ(contents("a.txt"), std::string("second\0\n", 8));
  write_file_atomically("empty.txt", "");
  EXPECT_EQ(contents("empty.txt"), "");
  EXPECT_EQ(count_entries(), 2U);
}

TEST_F(AtomicFile, WritesThroughLinks) {
  write("real.txt", "old");
  fs::create_symlink("real.txt", "link.txt");
  write_file_atomically("link.txt", "new");
  EXPECT_TRUE(fs::is_symlink("link.txt"));
  EXPECT_EQ(contents("real.txt"), "new");
}

TEST_F(AtomicFile, WritesThroughLinksToWhatIsMissing) {
  fs::create_directory("folder");
  fs::create_symlink("folder/real.txt", "link.txt");
  fs::create_symlink("link.txt", "second.txt");
  fs::create_symlink("../real_2.txt", "folder/third.txt");
  write_file_atomically("second.txt", "new");
  write_file_atomically("folder/third.txt", "new, too");
  EXPECT_TRUE(fs::is_symlink("link.txt") && fs::is_symlink("second.txt") && fs::is_symlink("folder/third.txt"));
  EXPECT_EQ(contents("folder/real.txt"), "new");
  EXPECT_EQ(contents("real_2.txt"), "new, too");
}

TEST_F(AtomicFile, KeepsLinksThatLeadNowhere) {
  fs::create_symlink("no/real.txt", "link.txt");
  fs::create_symlink("a.txt", "b.txt");
  fs::create_symlink("b.txt", "a.txt");
  EXPECT_EQ(error_of([] { write_file_atomically("link.txt", "text"); }),
            "cannot write 'link.txt': it is a link to 'no/real.txt', and there is no folder 'no'");
  EXPECT_EQ(error_of([] { write_file_atomically("a.txt", "text"); }), "cannot write 'a.txt': its links form a loop");
  EXPECT_EQ(error_of([] { create_output_directory("link.txt"); }),
            "cannot use 'link.txt' as the folder for output: it is a link to 'no/real.txt', which is missing");
  EXPECT_EQ(count_entries(), 3U);
}

TEST_F(AtomicFile, RefusesPathsThatCannotBeWritten) {
  const auto write_error = [](const std::string& path) {
    return error_of([&] { write_file_atomically(path, "text"); });
  };
  EXPECT_EQ(write_error("no/such/a.txt"), "cannot write 'no/such/a.txt': there is no folder 'no/such'");
  fs::create_directory("folder");
  EXPECT_EQ(write_error("folder"), "cannot write 'folder': it is a folder; a file is needed");
  EXPECT_EQ(count_entries(), 1U);
}

TEST_F(LockedFolder, HasOneHolder) {
  {
    const FolderLock lock(".");
    EXPECT_EQ(contents(".pulson.lock"), std::to_string(::getpid()) + "\n");
    EXPECT_EQ(error_of([] { const FolderLock other("."); }),
              "another pulson (process " + std::to_string(::getpid()) +
                  ") writes into '.' at present; wait until it ends, or choose another folder");
    EXPECT_TRUE(fs::exists(".pulson.lock"));
  }
  EXPECT_FALSE(fs::exists(".pulson.lock"));
  write(".pulson.lock", "4711\n");  // of a process that was killed
  { const FolderLock lock("."); }
  EXPECT_FALSE(fs::exists(".pulson.lock"));
}

TEST_F(LockedFolder, HasAHolderForEachFile) {
  const FolderLock lock(".", "a");
  const FolderLock other(".", "b");
  EXPECT_EQ(error_of([] { const FolderLock again(".", "a"); }),
            "another pulson (process " + std::to_string(::getpid()) +
                ") writes './a' at present; wait until it ends, or choose another folder");
}

TEST_F(AtomicFile, SaysThatADeviceIsFull) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full";
  EXPECT_EQ(error_of([] { write_file_atomically("/dev/full", "text"); }),
            "cannot write '/dev/full': No space left on device");
  EXPECT_TRUE(fs::is_character_file("/dev/full"));
}

TEST_F(AtomicFile, KeepsTheOldContentsWhenTheNewDoNotFit) {
  write_file_atomically("a.txt", "old");
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{1000, before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &small);
  const std::string message = error_of([] { write_file_atomically("a.txt", std::string(100000, 'x')); });
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_EQ(message, "cannot write 'a.txt': File too large");
  EXPECT_EQ(contents("a.txt"), "old");
  EXPECT_EQ(count_entries(), 1U);
}

TEST_F(AtomicFile, NeedsPermission) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may write everywhere";
  fs::create_directory("locked");
  fs::permissions("locked", fs::perms::owner_read | fs::perms::owner_exec);
  EXPECT_EQ(error_of([] { write_file_atomically("locked/a.txt", "text"); }),
            "cannot write 'locked/a.txt': Permission denied");
  EXPECT_EQ(error_of([] { create_output_directory("locked"); }),
            "cannot use 'locked' as the folder for output: Permission denied");
}

TEST_F(OutputDirectory, IsMadeWithThoseAboveIt) {
  create_output_directory("a/b/c/");
  create_output_directory("a/b/c");
  create_output_directory(".");
  EXPECT_TRUE(fs::is_directory("a/b/c"));
  write("file", "");
  EXPECT_EQ(error_of([] { create_output_directory("file"); }),
            "cannot use 'file' as the folder for output: it is a file");
  EXPECT_THAT(error_of([] { create_output_directory("file/below"); }),
              StartsWith("cannot use 'file/below' as the folder for output: "));
}

}  // namespace
}  // namespace pulson
