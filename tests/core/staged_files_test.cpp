#include "core/staged_files.hpp"

#include <csignal>
#include <filesystem>
#include <string>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "core/atomic_file.hpp"
#include "temporary_folder.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;

using StagedFolder = InTemporaryFolder;

TEST_F(StagedFolder, TakesAllFilesOrNone) {
  write("old.txt", "old");
  {
    StagedFiles staged(".");
    staged.write("old.txt", "new");
    staged.write("more.txt", "more");
  }
  EXPECT_EQ(count_entries(), 1U);
  EXPECT_EQ(contents("old.txt"), "old");
  StagedFiles staged(".");
  staged.write("old.txt", "new");
  staged.write("more.txt", "more");
  staged.commit();
  EXPECT_EQ(contents("old.txt"), "new");
  EXPECT_EQ(contents("more.txt"), "more");
}

TEST_F(StagedFolder, RemovesWhatAKilledProcessLeft) {
  const pid_t child = ::fork();
  if (child == 0) {
    StagedFiles staged(".");
    staged.write("a.txt", "text");
    std::raise(SIGKILL);
  }
  ASSERT_EQ(::waitpid(child, nullptr, 0), child);
  EXPECT_EQ(count_entries(), 1U);
  StagedFiles first(".");
  first.write("b.txt", "text");
  EXPECT_EQ(count_entries(), 1U);
  const StagedFiles second(".");  // beside one that is alive
  EXPECT_EQ(count_entries(), 2U);
  first.commit();
  EXPECT_EQ(contents("b.txt"), "text");
}

TEST_F(StagedFolder, WritesThroughLinks) {
  write("real.txt", "old");
  fs::create_directory("out");
  fs::create_symlink("../real.txt", "out/link.txt");
  StagedFiles staged("out");
  staged.write("link.txt", "new");
  staged.commit();
  EXPECT_TRUE(fs::is_symlink("out/link.txt"));
  EXPECT_EQ(contents("real.txt"), "new");
}

TEST_F(StagedFolder, SaysThatADeviceIsFullBeforeItMovesAFile) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full";
  fs::create_directory("out");
  fs::create_symlink("/dev/full", "out/b.txt");
  {
    StagedFiles staged("out");
    staged.write("a.txt", "text");
    staged.write("b.txt", "text");
    EXPECT_EQ(error_of([&] { staged.commit(); }), "cannot write 'out/b.txt': No space left on device");
  }
  EXPECT_FALSE(fs::exists("out/a.txt"));
  EXPECT_EQ(error_of([] { const StagedFiles staged("none"); }).substr(0, 21), "cannot write 'none/.p");
}

TEST_F(StagedFolder, WritesThroughLinksToWhatIsMissing) {
  fs::create_symlink("real.txt", "link.txt");
  StagedFiles staged(".");
  staged.write("link.txt", "new");
  staged.commit();
  EXPECT_TRUE(fs::is_symlink("link.txt"));
  EXPECT_EQ(contents("real.txt"), "new");
}

// The last file cannot take its place, which a folder has: the others become what they were.
TEST_F(StagedFolder, TakesFilesBackWhereOneCannotBeMoved) {
  fs::create_directory("out");
  write("out/old.txt", "old");
  write("real.txt", "old");
  fs::create_symlink("../real.txt", "out/link.txt");
  {
    StagedFiles staged("out");
    for (const char* name : {"old.txt", "made.txt", "link.txt", "last.txt"}) staged.write(name, "new");
    fs::create_directories("out/last.txt/in it");
    EXPECT_EQ(error_of([&] { staged.commit(); }).substr(0, 30), "cannot write 'out/last.txt': I");
  }
  EXPECT_EQ(contents("out/old.txt"), "old");
  EXPECT_EQ(contents("real.txt"), "old");
  EXPECT_FALSE(fs::exists("out/made.txt"));
  EXPECT_EQ(count_entries(), 2U);
}

TEST_F(StagedFolder, OfSeveralFoldersAreAllMovedOrNone) {
  for (const char* folder : {"a", "b"}) fs::create_directory(folder);
  const auto commit = [] {
    StagedFiles a("a"), b("b");
    a.write("one.txt", "new");
    b.write("two.txt", "new");
    StagedFiles::commit_together({&a, &b});
  };
  fs::create_directories("b/two.txt/in it");
  EXPECT_NE(error_of(commit), "no error");
  EXPECT_FALSE(fs::exists("a/one.txt"));
  fs::remove_all("b/two.txt");
  commit();
  EXPECT_EQ(contents("a/one.txt") + contents("b/two.txt"), "newnew");
}

}  // namespace
}  // namespace pulson
