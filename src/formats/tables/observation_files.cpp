#include <cmath>
#include <string>

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/csv/csv_columns.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/formats/landmark_files.hpp"

namespace pulson::formats {
namespace {

// The rows of a table but its header, one for each landmark.
std::vector<CsvRecord> read_rows(const std::string& path, int count) {
  std::vector<CsvRecord> rows = csv_records(path, io::read_text_file(path));
  if (!rows.empty() && is_header(rows.front())) rows.erase(rows.begin());
  if (std::ssize(rows) != count)
    throw InputError(fmt::format("{} has {} of numbers; each of the {} landmarks needs one", path,
                                 io::counted(rows.size(), "row"), count));
  return rows;
}

Eigen::VectorXd numbers_of(const std::string& path, const CsvRecord& row) {
  Eigen::VectorXd numbers(std::ssize(row.fields));
  for (std::size_t i = 0; i < row.fields.size(); ++i) {
    const std::string& field = row.fields[i];
    const double number = io::is_number(field) ? parse_number(field, "") : std::nan("");
    if (!std::isfinite(number)) io::fail(path, row.line, io::in_quotes(field) + " is not a finite number");
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
  io::fail(path, row.line,
           fmt::format("{}; a covariance in {}D takes 1 (the variance), {} (variances of the axes), {} (upper triangle "
                       "by rows) or {} (all by rows)",
                       io::counted(row.fields.size(), "number"), d, d, d * (d + 1) / 2, d * d));
}

}  // namespace

Eigen::VectorXd read_weights(const std::filesystem::path& path, int count) {
  const std::string name = path.string();
  std::vector<double> weights;
  for (const CsvRecord& row : read_rows(name, count)) {
    const Eigen::VectorXd numbers = numbers_of(name, row);
    if (numbers.size() != 1)
      io::fail(name, row.line, io::counted(row.fields.size(), "number") + "; a row holds one weight");
    if (numbers[0] < 0) io::fail(name, row.line, fmt::format("the weight is {}; it must be 0 or greater", numbers[0]));
    weights.push_back(numbers[0]);
  }
  return Eigen::VectorXd::Map(weights.data(), count);
}

std::vector<Eigen::MatrixXd> read_covariances(const std::filesystem::path& path, int count, int dimension) {
  const std::string name = path.string();
  std::vector<Eigen::MatrixXd> covariances;
  for (const CsvRecord& row : read_rows(name, count)) {
    covariances.push_back(covariance_of(name, row, dimension));
    if (!is_covariance(covariances.back()))
      io::fail(name, row.line, "the covariance is not symmetric and positive definite");
  }
  return covariances;
}

}  // namespace pulson::formats
