#include <cstdint>
#include <fstream>
#include <limits>

#include "formats/json/json_text.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/records/records.hpp"

namespace pulson {
namespace {

// Reads keys of one file; every error names the file and the key.
class Reader {
 public:
  Reader(const Json& json, std::string file, std::string path = {})
      : json_(json), file_(std::move(file)), path_(std::move(path)) {}

  bool has(const std::string& key) const { return json_.is_object() && json_.contains(key); }
  Reader at(const std::string& key) const {
    if (!has(key)) fail(key, "is missing");
    return {json_.at(key), file_, path_.empty() ? key : path_ + "." + key};
  }
  template <class Value>
  Value as(std::string_view what) const {
    try {
      return json_.get<Value>();
    } catch (const Json::exception&) {
      fail({}, "is not " + std::string(what));
    }
  }
  double number() const { return as<double>("a number"); }
  std::string text() const { return as<std::string>("a text"); }
  std::vector<std::string> texts() const { return as<std::vector<std::string>>("a list of strings"); }
  int integer() const {
    if (!json_.is_number_integer()) fail({}, "is not a whole number");
    const auto value = json_.get<std::int64_t>();
    if (value < 0 || value > std::numeric_limits<int>::max()) fail({}, "is out of range");
    return static_cast<int>(value);
  }
  std::uint64_t seed() const {
    if (!json_.is_number_unsigned()) fail({}, "is not a seed, a whole number from 0");
    return json_.get<std::uint64_t>();
  }
  // What `parse` makes of the text; its InputError gets the file and the key.
  template <class Parse>
  auto parsed(const Parse& parse) const {
    if (quoted_line(text()) != "'" + text() + "'")
      fail({}, "is " + quoted_line(text()) + " and holds a control character");
    try {
      return parse(text());
    } catch (const InputError& error) {
      fail({}, std::string("is wrong: ") + error.what());
    }
  }
  bool flag() const { return as<bool>("true or false"); }
  // rows as the columns of the matrix, each of `size` numbers
  Eigen::MatrixXd columns(Eigen::Index size) const {
    return columns_of(as<std::vector<std::vector<double>>>("a list of lists of numbers"), size);
  }
  // the same with null for a number that is not known, NaN in the matrix
  Eigen::MatrixXd columns_or_null(Eigen::Index size) const {
    std::vector<std::vector<double>> rows;
    for (const Json& row : json_) {
      rows.emplace_back();
      for (const Json& value : row)
        rows.back().push_back(value.is_null() ? std::numeric_limits<double>::quiet_NaN()
                                              : Reader(value, file_, path_).number());
    }
    return columns_of(rows, size);
  }
  Eigen::VectorXd numbers() const {
    const auto list = as<std::vector<double>>("a list of numbers");
    return Eigen::Map<const Eigen::VectorXd>(list.data(), static_cast<Eigen::Index>(list.size()));
  }
  std::vector<Reader> items() const {
    if (!json_.is_array()) fail({}, "is not a list");
    std::vector<Reader> readers;
    for (std::size_t i = 0; i < json_.size(); ++i)
      readers.emplace_back(json_[i], file_, path_ + "[" + std::to_string(i) + "]");
    return readers;
  }
  [[noreturn]] void fail(const std::string& key, const std::string& problem) const {
    const std::string place = key.empty() ? path_ : (path_.empty() ? key : path_ + "." + key);
    throw InputError(file_ + ": '" + place + "' " + problem);
  }

 private:
  Eigen::MatrixXd columns_of(const std::vector<std::vector<double>>& rows, Eigen::Index size) const {
    Eigen::MatrixXd matrix(size, static_cast<Eigen::Index>(rows.size()));
    for (std::size_t i = 0; i < rows.size(); ++i) {
      if (static_cast<Eigen::Index>(rows[i].size()) != size)
        fail({}, "has " + std::to_string(rows[i].size()) + " numbers in row " + std::to_string(i + 1) + "; " +
                     std::to_string(size) + " are needed");
      for (std::size_t c = 0; c < rows[i].size(); ++c)
        matrix(static_cast<Eigen::Index>(c), static_cast<Eigen::Index>(i)) = rows[i][c];
    }
    return matrix;
  }

  const Json& json_;
  std::string file_;
  std::string path_;
};

Eigen::Index first_row_size(const Reader& reader) {
  const auto rows = reader.as<std::vector<std::vector<double>>>("a list of lists of numbers");
  if (rows.empty() || rows.front().empty() || rows.front().size() > 3)
    reader.fail({}, "needs at least one landmark of 1, 2 or 3 coordinates");
  return static_cast<Eigen::Index>(rows.front().size());
}

Landmarks read_shape(const Reader& reader, Points points) {
  Landmarks shape;
  shape.points = std::move(points);
  shape.source = reader.at("file").text();
  shape.name = reader.at("name").text();
  shape.labels = reader.at("labels").texts();
  shape.groups = reader.at("groups").texts();
  if (reader.has("numbers")) shape.numbers = reader.at("numbers").as<std::vector<int>>("a list of whole numbers");
  if (reader.has("axes")) shape.axes = reader.at("axes").text();
  if (reader.has("y_down")) shape.y_down = reader.at("y_down").flag();
  if (reader.has("units")) shape.units = reader.at("units").text();
  const auto count = static_cast<std::size_t>(shape.count());
  if (!shape.numbers.empty() && shape.numbers.size() != count)
    reader.fail("numbers", "does not have the length of the shape");
  if (!shape.labels.empty() && shape.labels.size() != count)
    reader.fail("labels", "does not have the length of the shape");
  if (!shape.groups.empty() && shape.groups.size() != count)
    reader.fail("groups", "does not have the length of the shape");
  return shape;
}

DataOptions read_data(const Reader& reader, Eigen::Index d) {
  DataOptions data;
  data.kind = reader.at("kind").parsed(parse_data_kind);
  if (reader.has("ends")) data.ends = reader.at("ends").parsed(parse_curve_ends);
  if (reader.has("width")) data.width = reader.at("width").number();
  if (reader.has("weights")) data.weights = reader.at("weights").numbers();
  if (reader.has("covariances"))
    for (const Reader& item : reader.at("covariances").items()) data.covariances.push_back(item.columns(d));
  return data;
}

MatchingCost read_cost(const Reader& cost) {
  return {cost.at("energy").number(), cost.at("action").number(), cost.at("data").number()};
}

Points same_size(const Reader& reader, Eigen::Index d, Eigen::Index count) {
  Points points = reader.columns(d);
  if (points.cols() != count) reader.fail({}, "has a different number of landmarks from 'source'");
  return points;
}

Alignment read_alignment(const Reader& reader, Eigen::Index d) {
  Alignment alignment{reader.at("kind").parsed(parse_alignment), reader.at("scale").number(), {}, {}};
  const std::string linear = reader.has("rotation") ? "rotation" : "linear";  // the first is its name in old records
  alignment.linear = reader.at(linear).columns(d).transpose();
  const auto translation = reader.at("translation").as<std::vector<double>>("a list of numbers");
  if (alignment.linear.rows() != d || static_cast<Eigen::Index>(translation.size()) != d)
    reader.fail(linear, "has a different dimension from 'source'");
  alignment.translation = Eigen::Map<const Eigen::VectorXd>(translation.data(), d);
  return alignment;
}

Json parse_file(const std::filesystem::path& path) {
  std::ifstream file(path);
  if (!file || std::filesystem::is_directory(path)) throw InputError(path.string() + ": the file cannot be opened");
  try {
    return Json::parse(file);
  } catch (const Json::parse_error& error) {
    throw InputError(path.string() + ": not a JSON file (byte " + std::to_string(error.byte) + ")");
  } catch (const Json::out_of_range&) {
    throw InputError(path.string() + ": a number in it is beyond the range of numbers");
  }
}

DisplacementModel read_kernel_fit(const Reader& reader, const Registration& registration) {
  const KernelOperator kernel = make_kernel(registration.kernel);
  return {kernel.terms().front(),
          registration.lambda,
          reader.at("log_likelihood").number(),
          reader.at("prediction_error").number(),
          reader.at("alignment_error").number(),
          reader.at("landmarks").integer()};
}

std::vector<PhaseState> read_states(const Reader& reader, const Registration& registration) {
  const std::vector<Reader> positions = reader.at("positions").items(), momenta = reader.at("momenta").items();
  const auto count = static_cast<std::size_t>(registration.grid.steps) + 1;
  if (positions.size() != count || momenta.size() != count)
    reader.fail({}, "lacks the states of each step and of the end");
  const Points& q0 = registration.source.points;
  std::vector<PhaseState> states;
  for (std::size_t k = 0; k < count; ++k)
    states.push_back({same_size(positions[k], q0.rows(), q0.cols()), same_size(momenta[k], q0.rows(), q0.cols())});
  return states;
}

void read_setting(const Reader& reader, Registration& registration) {
  registration.kernel = reader.at("kernel").text();
  registration.noise = reader.at("noise").text();
  registration.mode = reader.at("mode").parsed(parse_mode);
  registration.integrator = reader.at("integrator").text();
  reader.at("integrator").parsed([](const std::string& name) { return make_integrator(name) != nullptr; });
  registration.grid = {reader.at("time").number(), reader.at("steps").integer()};
  registration.sigma = reader.at("sigma").number();
  registration.lambda = reader.at("lambda").number();
}

void read_outcome(const Reader& reader, Registration& registration) {
  registration.cost = read_cost(reader.at("cost"));
  registration.solver = reader.at("solver").parsed(parse_solver);
  registration.converged = reader.at("converged").flag();
  if (reader.has("step_error"))
    registration.step_error = {reader.at("step_error").at("rms").number(), reader.at("step_error").at("cost").number()};
  if (reader.has("amplification")) registration.amplification = reader.at("amplification").number();
  registration.stop_reason = reader.at("stop_reason").text();
  registration.iterations = reader.at("iterations").integer();
  registration.evaluations = reader.at("evaluations").integer();
  registration.relative_gradient = reader.at("relative_gradient").number();
  registration.seconds = reader.at("seconds").number();
  if (!reader.has("unknowns")) return;  // an old record
  registration.seed = reader.at("seed").seed();
  registration.samples = reader.at("samples").integer();
  registration.unknowns = reader.at("unknowns").integer();
  registration.notes = reader.at("notes").texts();
}

}  // namespace

Registration read_registration(const std::filesystem::path& path, const NoiseTable* own) {
  const Json json = parse_file(path);
  const Reader reader(json, path.string());
  Registration registration;
  read_setting(reader, registration);
  read_outcome(reader, registration);
  const Eigen::Index d = first_row_size(reader.at("source"));
  const Points source = reader.at("source").columns(d);
  registration.original = read_shape(reader.at("source_shape"), same_size(reader.at("original"), d, source.cols()));
  if (reader.has("data")) registration.data = read_data(reader.at("data"), d);
  const bool corresponds = registration.data.kind == DataKind::kLandmarks;
  Points target = reader.at("target").columns_or_null(d);
  if (corresponds && target.cols() != source.cols())
    reader.fail("target", "has a different number of landmarks from 'source'");
  registration.target = read_shape(reader.at("target_shape"), std::move(target));
  registration.source = registration.original;
  registration.source.points = source;
  registration.alignment = read_alignment(reader.at("alignment"), d);
  registration.result = same_size(reader.at("result"), d, source.cols());
  if (reader.has("spread")) registration.spread = same_size(reader.at("spread"), d, source.cols());
  registration.momenta = same_size(reader.at("momenta"), d, source.cols());
  reader.at("kernel").parsed([&](const std::string& spec) { return make_kernel(spec, source).at_zero(); });
  const int channels = reader.at("noise").parsed([&](const std::string& spec) {
    const auto noise = make_noise(spec, registration.source, own ? *own : noise_table());
    if (own) registration.own_noise = noise;
    noise->check(static_cast<int>(d), static_cast<int>(source.cols()));
    return noise->channels(static_cast<int>(d), static_cast<int>(source.cols()));
  });
  if (reader.has("kernel_fit")) registration.fitted_kernel = read_kernel_fit(reader.at("kernel_fit"), registration);
  registration.increments = reader.at("increments").columns(channels);
  if (registration.grid.steps < 1 || registration.increments.cols() != registration.grid.steps)
    reader.fail("increments", "has a different number of rows from 'steps'");
  if (reader.has("states")) registration.states = read_states(reader.at("states"), registration);
  return registration;
}

}  // namespace pulson
