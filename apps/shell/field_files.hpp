#pragma once

#include <optional>
#include <string>
#include <vector>

#include <CLI/App.hpp>
#include <nlohmann/json.hpp>

#include "draw/field_picture.hpp"
#include "pulson/warp/velocity_field.hpp"
#include "run_results.hpp"

namespace pulson {

/// `--field` and `--grid-points`, of verbs that follow a path.
struct FieldOptions {
  std::vector<std::string> files;
  std::optional<int> grid_points;

  /// @param path which is meant, for help: "the path" @param states the table that has its q and p
  void add_to(CLI::App& verb, const std::string& path, const std::string& states);

  /// @throws InputError where a file is of no such kind or cannot be written, of a picture in space, and where a field
  /// at so many times may have too many numbers
  void check(int dimension, int times) const;

  /// u of the path at every `every`-th step and its last; none where no file is asked for.
  std::optional<warp::VelocityField> field_of(const KernelOperator& kernel, const Trajectory& path,
                                              int every = 1) const;

 private:
  int points_along(int dimension) const;
};

/// What a record says of a field and its arrays: {"field": …}, or an empty object.
nlohmann::ordered_json field_json(const std::optional<warp::VelocityField>& field);

/// The picture of a field of a path from `start`.
draw::FieldPicture make_field_picture(const warp::VelocityField& field, const Trajectory& path, const Landmarks& start);

/// Writes each file, after the results were committed.
void write_field(const FieldOptions& options, const warp::VelocityField& field, const draw::FieldPicture& picture,
                 RunResults& results);

/// "field      21 times of 401 points: u.npy, u.png"; nothing where there is no field.
void print_field(const FieldOptions& options, const std::optional<warp::VelocityField>& field);

}  // namespace pulson
