#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <vector>

namespace pulson::draw {

inline constexpr double kFramesPerSecond = 12;
inline constexpr int kRestingFrames = 8;  ///< for the first and for the last state of a motion

/// Frames that the program ffmpeg, a child process, makes a GIF, an MP4 (H.264) or a WebP of, by the extension of
/// the file. It is written under a temporary name in its own folder and renamed by finish(); without that, or after a
/// failure, the destructor ends ffmpeg and leaves nothing behind. An object is for one thread; several may be open at
/// once. After finish() or an error from ffmpeg no other function may be called.
class Animation {
 public:
  /// Starts ffmpeg. Sizes are in pixels; an MP4 of an odd one gets a black column or row more, and a GIF's frames
  /// last whole hundredths of a second. @throws InputError if ffmpeg is not installed, the extension is another one,
  /// the file cannot be written there, or a number is not greater than 0
  Animation(const std::filesystem::path& file, int width, int height, double frames_per_second);
  Animation(const Animation&) = delete;
  Animation& operator=(const Animation&) = delete;
  ~Animation();

  /// The next frame: rows from the top, three bytes (red, green, blue) a pixel. @throws InputError if its size is
  /// another one, or if ffmpeg failed (with its message)
  void add(const std::vector<std::uint8_t>& rgb24);

  /// Waits for ffmpeg and puts the file in place.
  /// @throws InputError if ffmpeg failed (with its message), without frames, or if the file could not be written
  void finish();

  /// @throws InputError unless the extension is one of these
  static void check_extension(const std::filesystem::path& file);

  /// Whether there is an ffmpeg in the folders of PATH.
  static bool available();

 private:
  struct Encoder;
  std::unique_ptr<Encoder> encoder_;
};

}  // namespace pulson::draw
