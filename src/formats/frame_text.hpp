#pragma once

// The frame of a shape in files that have no place of their own for it.

#include <optional>
#include <string>
#include <string_view>

#include "json/json_reader.hpp"
#include "pulson/core/frame.hpp"
#include "pulson/core/landmarks.hpp"

namespace pulson::formats {

/// What begins the comment of a table that says its frame.
inline constexpr std::string_view kFrameComment = "frame:";

/// `y=up unit=0.02 origin=-2,-1.2 size=600x360 orientation=displayed`, without what is as in rows of a picture; empty
/// where all is.
std::string frame_text(const Frame& frame);

/// The frame that the first comment `# frame: …` of a table says. @throws InputError "path:line: ..." where it is wrong
std::optional<Frame> frame_in_comments(const std::string& path, std::string_view text);

/// The text of a table with this frame in place of what its comment `# frame: …` says; as it is where it has none.
std::string with_frame_comment(std::string text, const Frame& frame);

/// {unit_per_pixel, origin, y_down, orientation, width, height}; sizes that are not known are null.
Json frame_json(const Frame& frame);
Frame read_frame(const JsonValue& json);
/// The same of what frame_json wrote. @throws InputError where it is wrong
Frame frame_of_json(const Json& json);

/// Whether two shapes say the same.
bool are_same_frames(const Frame& a, const Frame& b);

}  // namespace pulson::formats
