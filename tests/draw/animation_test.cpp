#include "draw/animation.hpp"

#include <chrono>
#include <cstdlib>
#include <set>
#include <sstream>
#include <string>

#include <gtest/gtest.h>

#include "picture_files.hpp"

namespace pulson::draw {
namespace {

namespace fs = std::filesystem;

using Frame = std::vector<std::uint8_t>;

constexpr int kWidth = 33, kHeight = 21;  // odd, which an MP4 cannot have

/// A red and green gradient with a blue bar that moves.
Frame frame(int number) {
  Frame pixels;
  for (int y = 0; y < kHeight; ++y)
    for (int x = 0; x < kWidth; ++x)
      for (const int value : {7 * x, 12 * y, x / 3 == number ? 255 : 0})
        pixels.push_back(static_cast<std::uint8_t>(value));
  return pixels;
}

/// PATH is set to another value as long as this lives.
class Path {
 public:
  explicit Path(const std::string& value) {
    if (const char* const old = std::getenv("PATH")) old_ = old;
    setenv("PATH", value.c_str(), 1);
  }
  Path(const Path&) = delete;
  Path& operator=(const Path&) = delete;
  ~Path() { setenv("PATH", old_.c_str(), 1); }

 private:
  std::string old_;
};

class AnimationTest : public PictureTest {
 protected:
  /// Makes a script called ffmpeg and returns the PATH on which it is found first.
  static std::string fake_ffmpeg(const std::string& script) {
    fs::create_directory("bin");
    write("bin/ffmpeg", "#!/bin/sh\n" + script);
    fs::permissions("bin/ffmpeg", fs::perms::owner_all);
    return (fs::current_path() / "bin").string() + ":/usr/bin:/bin";
  }

  /// The error of ten large frames, more than the connection to ffmpeg holds.
  static std::string error_of_large_frames(const std::string& file) {
    return error_of([&] {
      Animation animation(file, 1000, 1000, 10);
      for (int k = 0; k < 10; ++k) animation.add(Frame(3000000));
      animation.finish();
    });
  }

  static void write_ten_frames(const std::string& file) {
    Animation animation(file, kWidth, kHeight, 10);
    for (int k = 0; k < 10; ++k) animation.add(frame(k));
    animation.finish();
  }
};

TEST_F(AnimationTest, WritesEachFormat) {
  if (!Animation::available()) GTEST_SKIP() << "ffmpeg is not installed";
  write("ten frames.gif", "an older file");
  write_ten_frames("ten frames.gif");
  write_ten_frames("b.MP4");
  write_ten_frames("c.webp");
  EXPECT_EQ(files(), (std::set<std::string>{"b.MP4", "c.webp", "ten frames.gif"}));
  const std::string gif = contents("ten frames.gif"), mp4 = contents("b.MP4"), webp = contents("c.webp");
  EXPECT_EQ(gif.substr(0, 6), "GIF89a");
  EXPECT_EQ(gif.substr(6, 4), (std::string{kWidth, 0, kHeight, 0}));
  EXPECT_EQ(count_of(gif, std::string("\x21\xF9\x04", 3)), 10U) << "frames";
  EXPECT_TRUE(contains(gif, "NETSCAPE2.0")) << "it is repeated";
  EXPECT_EQ(mp4.substr(4, 4), "ftyp");
  EXPECT_LT(mp4.find("moov"), mp4.find("mdat")) << "for players that begin before they have all of it";
  EXPECT_EQ(webp.substr(0, 4) + webp.substr(8, 4), "RIFFWEBP");
  EXPECT_EQ(count_of(webp, "ANMF"), 10U);
}

TEST_F(AnimationTest, LeavesNothingBehindUnlessItIsFinished) {
  if (!Animation::available()) GTEST_SKIP() << "ffmpeg is not installed";
  write("a.gif", "an older file");
  {
    Animation animation("a.gif", kWidth, kHeight, 10);
    animation.add(frame(0));
  }
  EXPECT_EQ(error_of([] { Animation("a.gif", kWidth, kHeight, 10).finish(); }), "animation 'a.gif': it has no frames");
  EXPECT_EQ(error_of([] { Animation("a.gif", kWidth, kHeight, 10).add(Frame(7)); }),
            "animation 'a.gif': a frame has 7 bytes; 2079 are needed");
  EXPECT_EQ(files(), std::set<std::string>{"a.gif"});
  EXPECT_EQ(contents("a.gif"), "an older file");
}

TEST_F(AnimationTest, NeedsFfmpeg) {
  const Path empty(fs::current_path().string());
  EXPECT_FALSE(Animation::available());
  for (const char* const file : {"a.gif", "a.mp4", "a.webp"})
    EXPECT_EQ(error_of([&] { Animation(file, 32, 32, 10); }), "animations need ffmpeg; install the package ffmpeg");
  EXPECT_TRUE(files().empty());
}

TEST_F(AnimationTest, RefusesWhatCannotBeWritten) {
  const Path fake(fake_ffmpeg("exit 0\n"));
  EXPECT_EQ(error_of([] { Animation("a.avi", 32, 32, 10); }),
            "animation 'a.avi': its extension is '.avi'; it must be .gif, .mp4 or .webp");
  EXPECT_EQ(error_of([] { Animation("a.gif", 32, 0, 10); }),
            "animation 'a.gif': its size is 32 × 0; both must be 1 or greater");
  EXPECT_EQ(error_of([] { Animation("a.gif", 32, 32, 0); }),
            "animation 'a.gif': it has 0 frames per second; more than 0 are needed");
  EXPECT_EQ(error_of([] { Animation("no/a.gif", 32, 32, 10); }), "cannot write 'no/a.gif': there is no folder 'no'");
  EXPECT_EQ(files(), std::set<std::string>{"bin"});
}

TEST_F(AnimationTest, TellsWhyFfmpegFailed) {
  const Path fake(
      fake_ffmpeg("echo 'frame 1'\necho \"Unknown encoder 'libx264'\" >&2\necho >&2\n"
                  "echo 'Conversion failed!' >&2\nexit 1\n"));
  EXPECT_EQ(error_of_large_frames("a.mp4"), "ffmpeg failed: Unknown encoder 'libx264'");
  fake_ffmpeg("cat >/dev/null\nprintf 'no space\\r\\n' >&2\nexit 1\n");
  EXPECT_EQ(error_of_large_frames("a.mp4"), "ffmpeg failed: no space");
  fake_ffmpeg("exit 3\n");
  EXPECT_EQ(error_of_large_frames("a.mp4"), "ffmpeg failed: it printed no message");
  fake_ffmpeg("kill -9 $$\n");
  EXPECT_EQ(error_of_large_frames("a.mp4"), "ffmpeg failed: it was killed by signal 9");
  fake_ffmpeg("exit 0\n");
  EXPECT_EQ(error_of_large_frames("a.mp4").substr(0, 48), "ffmpeg ended before the animation 'a.mp4' did: B");
  fake_ffmpeg("cat >/dev/null\n");
  EXPECT_EQ(error_of_large_frames("a.mp4"), "ffmpeg did not write 'a.mp4'");
  EXPECT_EQ(files(), std::set<std::string>{"bin"});
}

// A file is named by its absolute path, and the process is not in our group, which Ctrl-C ends.
TEST_F(AnimationTest, RunsFfmpegInAGroupOfItsOwnWithNamesThatAreNotInterpreted) {
  const Path fake(fake_ffmpeg(
      "for last; do :; done\ncut -d' ' -f1,5 /proc/$$/stat >group\nprintf %s \"$0\" >called\ncat >/dev/null\n"
      "printf %s \"$last\" >given\nprintf x >\"${last#file:}\"\n"));
  for (const std::string name : {"-y.gif", "%d.gif", "pipe:1.gif", "it's <a>.gif", "a\nb.gif", "`touch X`.gif"}) {
    write_ten_frames(name);
    EXPECT_EQ(contents(name), "x") << name;
    EXPECT_EQ(contents("given").substr(0, 6), "file:/");
    EXPECT_EQ(contents("called"), (fs::current_path() / "bin/ffmpeg").string());
    int process = 0, group = 1;
    std::istringstream(contents("group")) >> process >> group;
    EXPECT_EQ(process, group);
  }
  EXPECT_FALSE(fs::exists("X"));
}

TEST_F(AnimationTest, EndsAnFfmpegThatHangs) {
  const Path fake(fake_ffmpeg("exec sleep 1000\n"));
  const auto begin = std::chrono::steady_clock::now();
  { const Animation animation("a.gif", 32, 32, 10); }
  EXPECT_LT(std::chrono::steady_clock::now() - begin, std::chrono::seconds(100));
  EXPECT_EQ(files(), std::set<std::string>{"bin"});
}

}  // namespace
}  // namespace pulson::draw
