#include <cmath>
#include <csignal>
#include <filesystem>
#include <limits>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <unistd.h>

#include "pulson/io/atomic_file.hpp"
#include "pulson/io/landmark_files.hpp"
#include "temporary_folder.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using testing::StartsWith;

using CsvWriter = InTemporaryFolder;
using AtomicFile = InTemporaryFolder;
using OutputDirectory = InTemporaryFolder;

TEST_F(CsvWriter, WritesTheFewestDigits) {
  Landmarks shape;
  shape.points = points_2d({0.1, -2, 1e300, 1.0 / 3});
  EXPECT_EQ(landmarks_csv(shape), "x,y\n0.1,-2\n1e+300,0.3333333333333333\n");
  shape.points = (Points(1, 2) << 0, 1).finished();
  EXPECT_EQ(landmarks_csv(shape), "x\n0\n1\n");
  shape.points = Eigen::Vector3d(1, 2, 3);
  EXPECT_EQ(landmarks_csv(shape), "x,y,z\n1,2,3\n");
}

TEST_F(CsvWriter, IsReadBackToTheSameBits) {
  Landmarks shape;
  shape.points = 1e-3 * Points::Random(3, 40);
  shape.points(0, 0) = std::numeric_limits<double>::denorm_min();
  shape.points(1, 0) = std::numeric_limits<double>::max();
  for (int i = 0; i < shape.count(); ++i) {
    shape.labels.push_back("tip \"" + std::to_string(i) + "\", left");
    shape.groups.emplace_back(i % 2 == 0 ? "#even" : "odd");
  }
  write_landmarks_csv("out.csv", shape);
  const Landmarks back = read_landmarks("out.csv");
  EXPECT_EQ(back.points, shape.points);
  EXPECT_EQ(back.labels, shape.labels);
  EXPECT_EQ(back.groups, shape.groups);
}

TEST_F(CsvWriter, KeepsMissingCoordinates) {
  Landmarks shape;
  shape.points = points_2d({1, std::numeric_limits<double>::quiet_NaN(), 3, 4});
  write_landmarks_csv("out.csv", shape);
  const Points back = read_landmarks("out.csv").points;
  EXPECT_EQ(back(0, 0), 1);
  EXPECT_TRUE(std::isnan(back(1, 0)));
  EXPECT_EQ(back.col(1), shape.points.col(1));
}

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

TEST_F(AtomicFile, RefusesPathsThatCannotBeWritten) {
  const auto write_error = [](const std::string& path) {
    return error_of([&] { write_file_atomically(path, "text"); });
  };
  EXPECT_EQ(write_error("no/such/a.txt"), "cannot write 'no/such/a.txt': there is no folder 'no/such'");
  fs::create_directory("folder");
  EXPECT_EQ(write_error("folder"), "cannot write 'folder': it is a folder; a file is needed");
  EXPECT_EQ(count_entries(), 1U);
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
