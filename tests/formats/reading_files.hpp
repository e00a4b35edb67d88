#pragma once

#include <limits>
#include <string>
#include <string_view>

#include "pulson/formats/landmark_files.hpp"
#include "temporary_folder.hpp"

namespace pulson::formats {

/// A coordinate that is missing.
inline constexpr double kNone = std::numeric_limits<double>::quiet_NaN();

/// Two landmarks, which a test of each format reads from every way to write them.
inline const Points kPair = points_2d({1.5, -2, 3e2, 0.25});

/// Reads landmark files of a given text.
class ReadingFiles : public InTemporaryFolder {
 protected:
  static LandmarkFile read(const std::string& name, const std::string& text) {
    write(name, text);
    return read_landmark_file(name);
  }

  static Landmarks read_one(const std::string& name, const std::string& text) {
    write(name, text);
    return read_landmarks(name);
  }

  static std::string read_error(const std::string& name, const std::string& text) {
    return error_of([&] { read(name, text); });
  }

  static std::string address_error(const std::string& address) {
    return error_of([&] { read_landmarks(address); });
  }

  static std::string write_error(const std::string& name, const LandmarkFile& file, std::string_view format = {}) {
    return error_of([&] { write_landmark_file(name, file, format); });
  }
};

/// The same where only the content identifies the format.
class ReadingTexts : public ReadingFiles {
 protected:
  static LandmarkFile read(const std::string& text) { return ReadingFiles::read("t.txt", text); }
  static std::string read_error(const std::string& text) { return ReadingFiles::read_error("t.txt", text); }
};

}  // namespace pulson::formats
