// Tables of numbers without a header, as the programs of IMP write them: a shape per line, x1 y1 x2 y2 ... and the
// centroid size as the last number.

#include <algorithm>
#include <cmath>
#include <optional>

#include <fmt/format.h>

#include "core/text.hpp"
#include "csv_columns.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::formats {
namespace {

constexpr std::size_t kFewestLandmarks = 2;

/// A line of numbers alone, missing ones as NaN.
Eigen::VectorXd numbers_of(const CsvRecord& record) {
  Eigen::VectorXd numbers(std::ssize(record.fields));
  for (std::size_t i = 0; i < record.fields.size(); ++i)
    numbers[static_cast<Eigen::Index>(i)] =
        text::is_number(record.fields[i]) ? parse_number(record.fields[i], "") : text::kMissing;
  return numbers;
}

std::vector<Eigen::VectorXd> rows_of(const std::vector<CsvRecord>& records) {
  std::vector<Eigen::VectorXd> rows;
  for (const CsvRecord& record : records) rows.push_back(numbers_of(record));
  return rows;
}

/// Of all numbers but the last, `dimension` of each landmark; NaN where one is missing.
double size_of(const Eigen::VectorXd& row, Eigen::Index dimension) {
  const Eigen::Map<const Points> points(row.data(), dimension, (row.size() - 1) / dimension);
  return (points.colwise() - points.rowwise().mean()).norm();
}

/// Whether the last number of each line is the centroid size of those before it.
bool end_in_size(const std::vector<Eigen::VectorXd>& rows, Eigen::Index dimension) {
  // programs of IMP write coordinates with 4 decimals or more of a size of 1 or more
  constexpr double kRounding = 2e-3;
  return std::all_of(rows.begin(), rows.end(), [&](const Eigen::VectorXd& row) {
    const double size = size_of(row, dimension);
    return size > 0 && std::abs(row[row.size() - 1] - size) <= kRounding * size;
  });
}

/// Pearson's correlation of the last numbers with the centroid sizes; 1 where these are equal, as of shapes that were
/// superimposed at one size.
double correlation_with_size(const std::vector<Eigen::VectorXd>& rows) {
  constexpr double kEqual = 1e-3;
  const Eigen::Index count = std::ssize(rows);
  Eigen::ArrayXd last(count), size(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::VectorXd& row = rows[static_cast<std::size_t>(i)];
    last[i] = row[row.size() - 1];
    size[i] = size_of(row, 2);
  }
  if (size.maxCoeff() - size.minCoeff() <= kEqual * size.maxCoeff()) return 1;
  last -= last.mean();
  size -= size.mean();
  return (last * size).sum() / std::sqrt(last.square().sum() * size.square().sum());
}

/// Whether the last numbers of an odd count may be sizes though they are not those of the coordinates, which were
/// superimposed: x and y in turn leave one number over, and it exceeds all others of its line. A count that is also one
/// of landmarks in space needs sizes that go with those of the coordinates.
bool may_end_in_size(const std::vector<Eigen::VectorXd>& rows) {
  const Eigen::Index count = rows.front().size();
  if (count % 2 == 0 || rows.size() < 2) return false;
  const bool are_largest = std::all_of(rows.begin(), rows.end(), [](const Eigen::VectorXd& row) {
    return row.allFinite() && row[row.size() - 1] > row.head(row.size() - 1).cwiseAbs().maxCoeff();
  });
  if (!are_largest) return false;
  constexpr double kCorrelated = 0.9;  // of 3 lines or more by chance at most once in 7
  return count % 3 != 0 || (rows.size() > 2 && correlation_with_size(rows) >= kCorrelated);
}

/// The dimension of the landmarks before a size; none where the last number is none.
std::optional<Eigen::Index> dimension_before_size(const std::vector<CsvRecord>& records) {
  const std::size_t width = records.front().fields.size();
  const bool are_numbers = std::all_of(records.begin(), records.end(), [&](const CsvRecord& record) {
    return record.fields.size() == width && holds_numbers(record);
  });
  if (!are_numbers || width < 2 * kFewestLandmarks + 1) return std::nullopt;
  const std::vector<Eigen::VectorXd> rows = rows_of(records);
  for (const Eigen::Index d : {2, 3})
    if ((width - 1) % static_cast<std::size_t>(d) == 0 && end_in_size(rows, d)) return d;
  if (are_alike(records) && may_end_in_size(rows) && !counts_lines(records, 0, 0)) return 2;
  return std::nullopt;
}

}  // namespace

bool are_alike(const std::vector<CsvRecord>& records) {
  // The variance of a number between lines, against that of the numbers of a line: shapes of one orientation and size
  // vary by a few per cent of their diameter, the axes of one shape by as much as it is wide.
  constexpr double kAlike = 0.05;
  const Eigen::Index count = std::ssize(records);
  if (count < 2) return false;
  Eigen::MatrixXd numbers(std::ssize(records.front().fields) - 1, count);
  for (Eigen::Index i = 0; i < count; ++i) {
    const Eigen::VectorXd row = numbers_of(records[static_cast<std::size_t>(i)]);
    if (row.size() != numbers.rows() + 1) return false;
    numbers.col(i) = row.head(numbers.rows());
  }
  const double between = (numbers.colwise() - numbers.rowwise().mean()).squaredNorm();
  const double all = (numbers.array() - numbers.mean()).square().sum();
  return between < kAlike * all;
}

bool fits_size_rows(const std::vector<CsvRecord>& records) { return dimension_before_size(records).has_value(); }

LandmarkFile read_size_rows(const std::string& path, const std::vector<CsvRecord>& records) {
  const Eigen::Index d = *dimension_before_size(records);
  const std::size_t width = records.front().fields.size();
  LandmarkFile file;
  for (const CsvRecord& record : records) {
    const Eigen::VectorXd row = numbers_of(record);
    Landmarks& shape = file.shapes.emplace_back();
    shape.points = Points::Map(row.data(), d, (row.size() - 1) / d);
    shape.properties.emplace_back("CS", record.fields.back());
  }
  const bool is_its_size = end_in_size(rows_of(records), d);
  file.warnings = {fmt::format("{}: {} numbers per line without a header, read as shapes of {} in {}D; the last is {}",
                               path, width,
                               text::counted(static_cast<std::size_t>(file.shapes.front().count()), "landmark"), d,
                               is_its_size ? "their centroid size"
                                           : "taken for the centroid size before they were superimposed, as IMP writes "
                                             "it, which theirs is not")};
  return file;
}

}  // namespace pulson::formats
