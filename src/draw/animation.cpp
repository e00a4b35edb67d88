#include "draw/animation.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>

#include "child_process.hpp"
#include "core/atomic_file.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::draw {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFfmpeg = "ffmpeg";

/// The options of ffmpeg for the extension of a file.
struct Format {
  std::string_view extension;
  std::vector<std::string> arguments;
};

const std::array<Format, 3>& formats() {
  static const std::array<Format, 3> rows = {{
      // One pass: ffmpeg holds the frames back until it has chosen the colours of all.
      {".gif",
       {"-filter_complex", "split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=bayer:bayer_scale=5",
        "-loop", "0", "-f", "gif"}},
      // Its sizes must be even. Players take colours that are not labelled for those of a size's usual standard.
      {".mp4",
       {"-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2,scale=out_color_matrix=bt709:out_range=tv,format=yuv420p", "-colorspace",
        "bt709", "-color_primaries", "bt709", "-color_trc", "bt709", "-color_range", "tv", "-c:v", "libx264", "-crf",
        "18", "-movflags", "+faststart", "-f", "mp4"}},
      {".webp", {"-c:v", "libwebp_anim", "-loop", "0", "-f", "webp"}},
  }};
  return rows;
}

const Format& format_of(const fs::path& file) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c;
  const auto* const format =
      std::find_if(formats().begin(), formats().end(), [&](const Format& row) { return row.extension == extension; });
  if (format == formats().end())
    throw InputError(
        fmt::format("animation '{}': its extension is '{}'; it must be .gif, .mp4 or .webp", file.string(), extension));
  return *format;
}

void check_numbers(const fs::path& file, int width, int height, double frames_per_second) {
  if (width < 1 || height < 1)
    throw InputError(
        fmt::format("animation '{}': its size is {} × {}; both must be 1 or greater", file.string(), width, height));
  if (!(std::isfinite(frames_per_second) && frames_per_second > 0))
    throw InputError(fmt::format("animation '{}': it has {} frames per second; more than 0 are needed", file.string(),
                                 frames_per_second));
}

/// The last line of what ffmpeg printed that says what is wrong.
std::string ffmpeg_error(std::string_view text) {
  constexpr std::string_view kBlanks = " \t\r\n";
  while (true) {
    text = text.substr(0, text.find_last_not_of(kBlanks) + 1);
    if (text.empty()) return "it printed no message";
    const std::size_t end_before = text.find_last_of("\r\n");
    const std::string_view line = text.substr(end_before == std::string_view::npos ? 0 : end_before + 1);
    if (line != "Conversion failed!" || end_before == std::string_view::npos) return std::string(line);
    text = text.substr(0, end_before);
  }
}

std::vector<std::string> arguments_of(const Format& format, int width, int height, double frames_per_second,
                                      const fs::path& output) {
  const std::string size = fmt::format("{}x{}", width, height), rate = fmt::format("{}", frames_per_second);
  std::vector<std::string> arguments = {
      "-nostdin", "-loglevel",   "error", "-y",         "-f", "rawvideo", "-pixel_format",
      "rgb24",    "-video_size", size,    "-framerate", rate, "-i",       "pipe:0"};
  arguments.insert(arguments.end(), format.arguments.begin(), format.arguments.end());
  arguments.push_back("file:" + output.string());  // a name and never an address
  return arguments;
}

}  // namespace

struct Animation::Encoder {
  fs::path file;
  TemporaryFile temporary;
  std::size_t frame_bytes;
  ChildProcess ffmpeg;  // after the file, so that it ends before that goes
  bool has_frames = false;

  Encoder(fs::path named, TemporaryFile to, std::size_t bytes_of_frame, const fs::path& program,
          const std::vector<std::string>& arguments)
      : file(std::move(named)), temporary(std::move(to)), frame_bytes(bytes_of_frame), ffmpeg(program, arguments) {}

  /// Tells ffmpeg that there are no more frames, and waits for it.
  void wait() {
    if (const std::string why = ffmpeg.wait(); !why.empty()) throw InputError("ffmpeg failed: " + ffmpeg_error(why));
  }
};

Animation::Animation(const fs::path& file, int width, int height, double frames_per_second) {
  const Format& format = format_of(file);
  check_numbers(file, width, height, frames_per_second);
  const fs::path ffmpeg = find_program(kFfmpeg);
  if (ffmpeg.empty()) throw InputError("animations need ffmpeg; install the package ffmpeg");
  require_file_path(file);
  std::error_code no_folder;
  TemporaryFile temporary(fs::absolute(file, no_folder), file);
  const std::vector<std::string> arguments = arguments_of(format, width, height, frames_per_second, temporary.path());
  encoder_ = std::make_unique<Encoder>(file, std::move(temporary), std::size_t{3} * width * height, ffmpeg, arguments);
}

Animation::~Animation() = default;

void Animation::add(const std::vector<std::uint8_t>& rgb24) {
  assert(encoder_);
  if (rgb24.size() != encoder_->frame_bytes)
    throw InputError(fmt::format("animation '{}': a frame has {} bytes; {} are needed", encoder_->file.string(),
                                 rgb24.size(), encoder_->frame_bytes));
  encoder_->has_frames = true;
  if (encoder_->ffmpeg.send(rgb24)) return;
  const std::string reason = std::strerror(errno);
  const std::unique_ptr<Encoder> encoder = std::move(encoder_);  // of no use any more
  encoder->wait();
  throw InputError(fmt::format("ffmpeg ended before the animation '{}' did: {}", encoder->file.string(), reason));
}

void Animation::finish() {
  assert(encoder_);
  const std::unique_ptr<Encoder> encoder = std::move(encoder_);  // ended in any case
  if (!encoder->has_frames) throw InputError(fmt::format("animation '{}': it has no frames", encoder->file.string()));
  encoder->wait();
  std::error_code error;
  if (const auto size = fs::file_size(encoder->temporary.path(), error); error || size == 0)
    throw InputError(fmt::format("ffmpeg did not write '{}'", encoder->file.string()));
  encoder->temporary.put_in_place();
}

void Animation::check_extension(const fs::path& file) { format_of(file); }

bool Animation::available() { return !find_program(kFfmpeg).empty(); }

}  // namespace pulson::draw
