#include "draw/animation.hpp"

#include <algorithm>
#include <array>
#include <cassert>
#include <cerrno>
#include <cmath>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <utility>

#include <fmt/format.h>
#include <sys/socket.h>
#include <unistd.h>

#include "gnuplot.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::draw {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFfmpeg = "ffmpeg";
constexpr const char* kNoFfmpeg = "animations need ffmpeg; install the package ffmpeg";

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

/// Sockets, where a pipe would kill us by SIGPIPE once ffmpeg has ended; children get only what is given to them.
std::array<int, 2> connected_sockets() {
  std::array<int, 2> ends{};
  if (::socketpair(AF_UNIX, SOCK_STREAM | SOCK_CLOEXEC, 0, ends.data()) != 0)
    throw InputError(fmt::format("cannot connect to ffmpeg: {}", std::strerror(errno)));
  return ends;
}

}  // namespace

struct Animation::Encoder {
  /// A file descriptor that is closed at its end.
  class Descriptor {
   public:
    explicit Descriptor(int number) : number_(number) {}
    Descriptor(const Descriptor&) = delete;
    Descriptor& operator=(const Descriptor&) = delete;
    ~Descriptor() { close(); }
    int number() const { return number_; }
    void close() {
      if (number_ >= 0) ::close(std::exchange(number_, -1));
    }

   private:
    int number_;
  };

  Encoder(fs::path named, std::size_t bytes_of_frame, std::array<int, 2> ends)
      : file(std::move(named)), frame_bytes(bytes_of_frame), frames(ends[0]), input(ends[1]) {}
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;
  ~Encoder() = default;

  void start(const Format& format, int width, int height, double frames_per_second) {
    require_file_path(file);
    std::error_code no_folder;
    temporary.emplace(fs::absolute(file, no_folder), file);
    std::vector<std::string> arguments = {kFfmpeg,
                                          "-nostdin",
                                          "-loglevel",
                                          "error",
                                          "-y",
                                          "-f",
                                          "rawvideo",
                                          "-pixel_format",
                                          "rgb24",
                                          "-video_size",
                                          fmt::format("{}x{}", width, height),
                                          "-framerate",
                                          fmt::format("{}", frames_per_second),
                                          "-i",
                                          "pipe:0"};
    arguments.insert(arguments.end(), format.arguments.begin(), format.arguments.end());
    arguments.push_back(temporary->path().string());
    program.emplace(std::move(arguments), input.number(), kNoFfmpeg);
    input.close();
  }

  /// Whether ffmpeg took them all; errno says why not.
  bool send(const std::vector<std::uint8_t>& bytes) const {
    for (std::size_t sent = 0; sent < bytes.size();) {
      const ssize_t count = ::send(frames.number(), bytes.data() + sent, bytes.size() - sent, MSG_NOSIGNAL);
      if (count < 0 && errno != EINTR) return false;
      if (count > 0) sent += static_cast<std::size_t>(count);
    }
    return true;
  }

  /// Tells ffmpeg that there are no more frames, and waits for it.
  void wait() {
    frames.close();
    if (!program->wait()) throw InputError("ffmpeg failed: " + ffmpeg_error(program->printed()));
  }

  fs::path file;
  std::optional<TemporaryFile> temporary{};
  std::size_t frame_bytes;
  Descriptor frames, input;
  std::optional<ChildProcess> program{};  // after the file, so that it ends before that goes
  bool has_frames = false;
};

Animation::Animation(const fs::path& file, int width, int height, double frames_per_second) {
  const Format& format = format_of(file);
  check_numbers(file, width, height, frames_per_second);
  if (!available()) throw InputError(kNoFfmpeg);
  encoder_ = std::make_unique<Encoder>(file, std::size_t{3} * width * height, connected_sockets());
  encoder_->start(format, width, height, frames_per_second);
}

Animation::~Animation() = default;

void Animation::add(const std::vector<std::uint8_t>& rgb24) {
  assert(encoder_);
  if (rgb24.size() != encoder_->frame_bytes)
    throw InputError(fmt::format("animation '{}': a frame has {} bytes; {} are needed", encoder_->file.string(),
                                 rgb24.size(), encoder_->frame_bytes));
  encoder_->has_frames = true;
  if (encoder_->send(rgb24)) return;
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
  require_written(kFfmpeg, *encoder->temporary);
  encoder->temporary->put_in_place();
}

bool Animation::available() { return is_on_path(kFfmpeg); }

}  // namespace pulson::draw
