// What holds for every row of the table of formats: what a row writes is taken by this row alone and read back to the
// same shapes, but for what it said that it cannot hold.

#include <algorithm>
#include <cctype>
#include <cmath>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include <gtest/gtest.h>

#include "error_of.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "written_landmarks.hpp"

namespace pulson::formats {

void PrintTo(const LandmarkFormat& format, std::ostream* stream) { *stream << format.name; }

namespace {

class EveryFormat : public testing::TestWithParam<LandmarkFormat> {};
class WrittenFormat : public EveryFormat {};

std::vector<LandmarkFormat> written_formats() {
  std::vector<LandmarkFormat> written;
  for (const LandmarkFormat& format : landmark_formats())
    if (format.write != nullptr) written.push_back(format);
  return written;
}

std::string test_name(const testing::TestParamInfo<LandmarkFormat>& info) {
  std::string name = info.param.name;
  std::replace(name.begin(), name.end(), '.', '_');
  return name;
}

/// The row that reading takes for this content.
std::string sniffed(std::string_view text) {
  for (const LandmarkFormat& format : landmark_formats())
    if (format.sniff(text)) return format.name;
  return "none";
}

bool is_reported(const std::vector<std::string>& losses, const std::string& part) {
  return std::any_of(losses.begin(), losses.end(),
                     [&](const std::string& loss) { return loss.find(part) != std::string::npos; });
}

LandmarkFile shapes_of(int d, int count) {
  LandmarkFile file;
  for (int i = 0; i < count; ++i)
    file.shapes.push_back(one_shape(hard_points(d, 7, static_cast<unsigned>(i) + 1)).shapes.front());
  return file;
}

void expect_written_and_read(const LandmarkFormat& format, const LandmarkFile& file) {
  const WrittenLandmarks written = format.write("a", file);
  EXPECT_EQ(sniffed(written.text), format.name) << written.text;
  const LandmarkFile back = format.read("a", written.text);
  ASSERT_EQ(back.shapes.size(), file.shapes.size());
  for (std::size_t s = 0; s < file.shapes.size(); ++s) {
    Points expected = file.shapes[s].points;
    if (is_reported(written.losses, "get z = 0")) {
      expected.conservativeResize(3, Eigen::NoChange);
      expected.row(2).setZero();
      for (const int missing : incomplete_points(expected)) expected.col(missing).setConstant(std::nan(""));
    }
    EXPECT_TRUE(have_same_bits(back.shapes[s].points, expected));
    std::vector<std::string> labels = file.shapes[s].labels;
    if (is_reported(written.losses, "cannot hold labels")) labels.clear();
    if (format.name == "bigwarp" && labels.empty())  // whose landmarks all have names
      for (int a = 0; a < file.shapes[s].count(); ++a) labels.push_back("Pt-" + std::to_string(a));
    EXPECT_EQ(back.shapes[s].labels, labels);
  }
}

/// Writes and reads, unless this is what the format refuses for the reason that `refusal` is part of.
void expect_written_or_refused(const LandmarkFormat& format, const LandmarkFile& file, const std::string& refusal) {
  const std::string message = error_of([&] { format.write("a", file); });
  if (message == "no error") return expect_written_and_read(format, file);
  EXPECT_NE(message.find(refusal), std::string::npos) << message;
}

TEST_P(EveryFormat, DescribesItself) {
  const LandmarkFormat& format = GetParam();
  EXPECT_FALSE(format.name.empty());
  EXPECT_FALSE(format.help.empty());
  EXPECT_EQ(format.help.find('\n'), std::string::npos);
  for (const std::string& extension : format.extensions) {
    EXPECT_FALSE(extension.empty());
    EXPECT_NE(extension.front(), '.');
    EXPECT_TRUE(std::none_of(extension.begin(), extension.end(), [](unsigned char c) { return std::isupper(c) != 0; }))
        << extension;
  }
}

TEST_P(EveryFormat, TakesNoOtherContent) {
  for (const std::string_view text :
       {std::string_view(), std::string_view("\0\1\2", 3), std::string_view(" \r\n"), std::string_view("\xEF\xBB\xBF"),
        std::string_view("\xEF\xBB\xBF\xEF\xBB\xBF"), std::string_view("Landmark 1 is the tip\nof the left wing\n")})
    EXPECT_FALSE(GetParam().sniff(text)) << text;
}

TEST_P(EveryFormat, HasANameOfItsOwn) {
  const auto& formats = landmark_formats();
  EXPECT_EQ(std::count_if(formats.begin(), formats.end(), [](const auto& f) { return f.name == GetParam().name; }), 1);
}

/// The fewest shapes that it holds.
int fewest_shapes(const LandmarkFormat& format) { return format.name == "bigwarp" ? 2 : 1; }

TEST_P(WrittenFormat, IsReadBack) {
  for (const int d : {2, 3}) expect_written_and_read(GetParam(), shapes_of(d, fewest_shapes(GetParam())));
}

TEST_P(WrittenFormat, IsReadBackWithLabels) {
  LandmarkFile file = shapes_of(3, fewest_shapes(GetParam()));
  for (Landmarks& shape : file.shapes) shape.labels = {"tip", "left, eye", "the \"fin\"", "#4", "5", "six seven", "x"};
  expect_written_and_read(GetParam(), file);
}

TEST_P(WrittenFormat, IsReadBackWithSeveralShapes) {
  for (const int d : {2, 3}) {
    LandmarkFile file = shapes_of(d, 4);
    for (Landmarks& shape : file.shapes) shape.name = "s" + std::to_string(&shape - file.shapes.data());
    expect_written_or_refused(GetParam(), file, "; there are 4");
  }
}

TEST_P(WrittenFormat, IsReadBackWithMissingLandmarks) {
  for (const int d : {2, 3})
    for (const int missing : {0, 3}) {
      LandmarkFile file = shapes_of(d, fewest_shapes(GetParam()));
      file.shapes.front().points.col(missing).setConstant(std::nan(""));
      expect_written_or_refused(GetParam(), file, "cannot hold missing coordinates");
    }
}

TEST_P(WrittenFormat, RefusesWhatIsEmpty) {
  EXPECT_EQ(error_of([] { GetParam().write("a", {}); }), "a: there are no shapes to write");
}

INSTANTIATE_TEST_SUITE_P(Rows, EveryFormat, testing::ValuesIn(landmark_formats()), test_name);
INSTANTIATE_TEST_SUITE_P(Rows, WrittenFormat, testing::ValuesIn(written_formats()), test_name);

}  // namespace
}  // namespace pulson::formats
