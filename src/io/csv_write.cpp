#include <fmt/format.h>

#include "pulson/io/atomic_file.hpp"
#include "pulson/io/landmark_files.hpp"

namespace pulson {
namespace {

bool needs_quotes(const std::string& text) { return text.find_first_of(",;\t\"# ") != std::string::npos; }

std::string csv_field(const std::string& text) {
  if (!needs_quotes(text)) return text;
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c);
  return field + '"';
}

}  // namespace

std::string landmarks_csv(const Landmarks& shape) {
  const bool has_labels = !shape.labels.empty();
  const bool has_groups = !shape.groups.empty();
  const std::string header = std::string("x,y,z").substr(0, static_cast<std::size_t>(2 * shape.dimension() - 1));
  std::string text = (has_labels ? "label," : "") + header + (has_groups ? ",group\n" : "\n");
  for (int i = 0; i < shape.count(); ++i) {
    const auto place = static_cast<std::size_t>(i);
    if (has_labels) text += csv_field(shape.labels[place]) + ',';
    const Eigen::VectorXd point = shape.points.col(i);
    text += fmt::format("{}", fmt::join(point.data(), point.data() + point.size(), ","));
    if (has_groups) text += ',' + csv_field(shape.groups[place]);
    text += '\n';
  }
  return text;
}

void write_landmarks_csv(const std::filesystem::path& path, const Landmarks& shape) {
  write_file_atomically(path, landmarks_csv(shape));
}

}  // namespace pulson
