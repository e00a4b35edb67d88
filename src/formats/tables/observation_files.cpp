#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "core/landmark_pairs.hpp"
#include "core/text.hpp"
#include "formats/csv/csv_columns.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {
namespace {

bool are_words(const std::vector<CsvRecord>& rows) {
  return !rows.empty() && std::none_of(rows.begin(), rows.end(),
                                       [](const CsvRecord& row) { return is_number_or_missing(row.fields.front()); });
}

// The column that names the landmarks: as its header says, or the first where it holds words.
std::optional<std::size_t> column_of_labels(const std::vector<CsvRecord>& header, const std::vector<CsvRecord>& rows) {
  if (rows.empty() || rows.front().fields.size() < 2) return std::nullopt;
  if (!header.empty())
    if (const std::optional<std::size_t> named = find_column(header.front(), ColumnRole::kLabel)) return named;
  const bool is_unnamed = !header.empty() && header.front().fields.front().empty();  // R's row names
  return is_unnamed || are_words(rows) ? std::optional<std::size_t>(0) : std::nullopt;
}

// Takes the labels out of the rows; none where the table has no such column.
NameList take_labels(const std::string& path, const std::vector<CsvRecord>& header, std::vector<CsvRecord>& rows) {
  NameList labels{path, {}};
  const std::optional<std::size_t> column = column_of_labels(header, rows);
  if (!column) return labels;
  for (CsvRecord& row : rows) {
    if (*column >= row.fields.size()) text::fail(path, row.line, "the row has no label; each needs one");
    labels.names.push_back(row.name(*column));
    row.fields.erase(row.fields.begin() + static_cast<std::ptrdiff_t>(*column));
  }
  return labels;
}

// The rows of a table but its header, without labels, one for each landmark and in their order.
std::vector<CsvRecord> read_rows(const std::string& path, const Landmarks& shape, std::string_view what,
                                 std::vector<std::string>* notes, bool by_order) {
  std::vector<CsvRecord> rows = csv_records(path, text::read_text_file(path)), header;
  if (!rows.empty() && is_header(rows.front())) {
    header.push_back(rows.front());
    rows.erase(rows.begin());
  }
  const NameList labels = take_labels(path, header, rows);
  std::vector<std::string> found;
  std::vector<CsvRecord> ordered;
  for (const int place :
       places_in_list(shape, labels, rows.size(), what, found, by_order ? PairBy::kOrder : PairBy::kNames))
    ordered.push_back(rows[static_cast<std::size_t>(place)]);
  if (notes != nullptr) notes->insert(notes->end(), found.begin(), found.end());
  return ordered;
}

Eigen::VectorXd numbers_of(const std::string& path, const CsvRecord& row) {
  Eigen::VectorXd numbers(std::ssize(row.fields));
  for (std::size_t i = 0; i < row.fields.size(); ++i) {
    const std::string& field = row.fields[i];
    const double number = text::is_number(field) ? parse_number(field, "") : std::nan("");
    if (!std::isfinite(number)) text::fail(path, row.line, text::in_quotes(field) + " is not a finite number");
    numbers[static_cast<Eigen::Index>(i)] = number;
  }
  return numbers;
}

Eigen::MatrixXd symmetric_matrix(const Eigen::VectorXd& upper_triangle, Eigen::Index d) {
  Eigen::MatrixXd matrix(d, d);
  Eigen::Index next = 0;
  for (Eigen::Index i = 0; i < d; ++i)
    for (Eigen::Index j = i; j < d; ++j) matrix(i, j) = matrix(j, i) = upper_triangle[next++];
  return matrix;
}

Eigen::MatrixXd covariance_of(const std::string& path, const CsvRecord& row, Eigen::Index d) {
  const Eigen::VectorXd numbers = numbers_of(path, row);
  if (numbers.size() == 1) return numbers[0] * Eigen::MatrixXd::Identity(d, d);
  if (numbers.size() == d) return numbers.asDiagonal();
  if (numbers.size() == d * (d + 1) / 2) return symmetric_matrix(numbers, d);
  if (numbers.size() == d * d) return numbers.reshaped(d, d).transpose();
  text::fail(
      path, row.line,
      fmt::format("{}; a covariance in {}D takes 1 (the variance), {} (variances of the axes), {} (upper triangle "
                  "by rows) or {} (all by rows)",
                  text::counted(row.fields.size(), "number"), d, d, d * (d + 1) / 2, d * d));
}

}  // namespace

Eigen::VectorXd read_weights(const std::filesystem::path& path, const Landmarks& shape, std::vector<std::string>* notes,
                             bool by_order) {
  const std::string name = path.string();
  std::vector<double> weights;
  for (const CsvRecord& row : read_rows(name, shape, "a weight", notes, by_order)) {
    const Eigen::VectorXd numbers = numbers_of(name, row);
    if (numbers.size() != 1)
      text::fail(name, row.line, text::counted(row.fields.size(), "number") + "; a row holds one weight");
    if (numbers[0] < 0)
      text::fail(name, row.line, fmt::format("the weight is {}; it must be 0 or greater", numbers[0]));
    weights.push_back(numbers[0]);
  }
  return Eigen::VectorXd::Map(weights.data(), std::ssize(weights));
}

std::vector<Eigen::MatrixXd> read_covariances(const std::filesystem::path& path, const Landmarks& shape,
                                              std::vector<std::string>* notes, bool by_order) {
  const std::string name = path.string();
  std::vector<Eigen::MatrixXd> covariances;
  for (const CsvRecord& row : read_rows(name, shape, "a covariance", notes, by_order)) {
    covariances.push_back(covariance_of(name, row, shape.dimension()));
    if (!is_covariance(covariances.back()))
      text::fail(name, row.line, "the covariance is not symmetric and positive definite");
  }
  return covariances;
}

}  // namespace pulson::formats
