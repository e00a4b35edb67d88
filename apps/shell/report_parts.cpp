#include "report_parts.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include <fmt/format.h>

#include "messages.hpp"
#include "options.hpp"
#include "program.hpp"
#include "pulson/core/version.hpp"
#include "register/picture.hpp"

namespace pulson {
namespace {

constexpr std::size_t kMostRows = 1000;  // of a table of landmarks
constexpr int kMostFrames = 41;
constexpr int kFewestFrames = 5;
constexpr std::int64_t kNumbers = 160'000;  // of a motion's places: about a megabyte of the page
constexpr double kLargest = 1e150;          // a length whose square is a number

}  // namespace

std::string report_number(double value, int digits) {
  return std::isfinite(value) ? fmt::format("{:.{}g}", value, digits) : "–";
}

std::string short_number(double value) {
  std::string text = fmt::format("{:.4g}", value);
  for (const char* zeros : {"e+0", "e+"})
    if (const std::size_t at = text.find(zeros); at != std::string::npos)
      text.replace(at, std::string_view(zeros).size(), "e");
  return text;
}

std::string conservation(double error) {
  constexpr double kMoreThanRounding = 1e-3;  // of the momenta: rounding adds up to 1e-8 in a million steps
  if (error == 0) return "conserved exactly";
  if (!std::isfinite(error)) return "undetermined: it left the range of numbers";
  if (error <= kMoreThanRounding) return fmt::format("conserved to {:.1e}", error);
  return fmt::format("not conserved: it changes by {:.1e}", error);
}

std::string count_in_words(std::int64_t count, const std::string& one, const std::string& several) {
  return count == 1 ? "one " + one : fmt::format("{} {}", count == 0 ? "no" : std::to_string(count), several);
}

std::string start_name(const Landmarks& shape) {
  return shape.source.starts_with("--") ? counted(shape.count(), "landmark") : short_name(shape);
}

std::string start_text(const Landmarks& shape) {
  constexpr Eigen::Index kMostNumbers = 6;
  if (!shape.source.starts_with("--") || shape.points.size() > kMostNumbers) return shape.source;
  std::vector<std::string> places;
  for (const auto place : shape.points.colwise()) {
    const std::vector<double> numbers(place.begin(), place.end());
    places.push_back(fmt::format("{:.4g}", fmt::join(numbers, "/")));
  }
  return fmt::format("{} {}", shape.source, fmt::join(places, ", "));
}

html::ReportTable landmark_table(const Landmarks& shape) {
  html::ReportTable table{{"landmark"}, {}, ""};
  if (!shape.labels.empty()) table.header.emplace_back("label");
  if (!shape.groups.empty()) table.header.emplace_back("group");
  return table;
}

std::vector<html::ReportCell> landmark_cells(const Landmarks& shape, int a) {
  const auto place = static_cast<std::size_t>(a);
  std::vector<html::ReportCell> row = {{fmt::to_string(shape.number(a))}};
  if (!shape.labels.empty()) row.push_back({shape.labels[place]});
  if (!shape.groups.empty()) row.push_back({shape.groups[place]});
  return row;
}

std::vector<int> listed_landmarks(const Eigen::VectorXd& values) {
  std::vector<int> order(static_cast<std::size_t>(values.size()));
  std::iota(order.begin(), order.end(), 0);
  if (order.size() <= kMostRows) return order;
  std::stable_sort(order.begin(), order.end(), [&](int a, int b) {
    return std::isnan(values[b]) ? !std::isnan(values[a]) : values[a] > values[b];
  });
  order.resize(kMostRows);
  std::sort(order.begin(), order.end());
  return order;
}

html::HtmlReport new_report(std::string title, std::string lead, const std::vector<std::string>& warnings,
                            const std::vector<std::string>& notes) {
  html::HtmlReport report{
      .title = std::move(title), .lead = std::move(lead), .command = command_line(), .version = "pulson " + version()};
  html::ReportSection remarks{"Remarks", {}};
  for (const std::string& text : warnings) remarks.blocks.emplace_back(html::ReportParagraph{"Warning: " + text});
  for (const std::string& text : notes)
    remarks.blocks.emplace_back(html::ReportParagraph{"Note: " + in_option_words(text)});
  if (!remarks.blocks.empty()) report.sections.push_back(std::move(remarks));
  return report;
}

void add_still(html::HtmlReport& report, const std::string& heading, const std::filesystem::path& picture,
               bool has_photograph) {
  if (picture.empty()) return;
  report.sections.push_back({heading,
                             {html::ReportPicture{.picture = picture,
                                                  .caption = fmt::format("Saved as {}.", picture.filename().string()),
                                                  .has_photograph = has_photograph}}});
}

std::vector<int> shown_frames(int last, std::int64_t numbers) {
  const auto most = static_cast<int>(
      std::clamp<std::int64_t>(kNumbers / std::max<std::int64_t>(numbers, 1), kFewestFrames, kMostFrames));
  const int stride = std::max(1, (last + most - 2) / (most - 1));
  std::vector<int> shown;
  for (int k = 0; k < last; k += stride) shown.push_back(k);
  shown.push_back(last);
  return shown;
}

bool can_be_drawn(const std::vector<Points>& frames) {
  return std::all_of(frames.begin(), frames.end(),
                     [](const Points& frame) { return (frame.array().abs() < kLargest).all(); });
}

}  // namespace pulson
