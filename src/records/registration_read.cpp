#include <utility>
#include <vector>

#include "core/text.hpp"
#include "formats/json/json_reader.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/records/records.hpp"

namespace pulson {
namespace {

using Reader = io::JsonValue;

// What `parse` makes of a text; its InputError gets the file and the key.
template <class Parse>
auto parsed(const Reader& reader, const Parse& parse) {
  const std::string text = reader.text();
  if (quoted_line(text) != "'" + text + "'") reader.fail("is " + quoted_line(text) + " and holds a control character");
  try {
    return parse(text);
  } catch (const InputError& error) {
    reader.fail(std::string("is wrong: ") + error.what());
  }
}

Eigen::Index first_row_size(const Reader& reader) {
  const std::vector<Reader> rows = reader.items();
  const std::size_t size = rows.empty() || !rows.front().value().is_array() ? 0 : rows.front().value().size();
  if (size < 1 || size > 3) reader.fail("needs at least one landmark of 1, 2 or 3 coordinates");
  return static_cast<Eigen::Index>(size);
}

Landmarks read_shape(const Reader& reader, Points points) {
  Landmarks shape;
  shape.points = std::move(points);
  shape.source = reader.at("file").text();
  shape.name = reader.at("name").text();
  shape.labels = reader.at("labels").texts();
  shape.groups = reader.at("groups").texts();
  if (reader.has("numbers"))
    for (const Reader& number : reader.at("numbers").items()) shape.numbers.push_back(number.count());
  if (reader.has("axes")) shape.axes = reader.at("axes").text();
  if (reader.has("y_down")) shape.y_down = reader.at("y_down").boolean();
  if (reader.has("units")) shape.units = reader.at("units").text();
  for (const auto& [key, size] :
       {std::pair("numbers", shape.numbers.size()), {"labels", shape.labels.size()}, {"groups", shape.groups.size()}})
    if (size > 0 && size != static_cast<std::size_t>(shape.count()))
      reader.at(key).fail("does not have the length of the shape");
  return shape;
}

DataOptions read_data(const Reader& reader, Eigen::Index d) {
  DataOptions data;
  data.kind = parsed(reader.at("kind"), parse_data_kind);
  if (reader.has("ends")) data.ends = parsed(reader.at("ends"), parse_curve_ends);
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
  if (points.cols() != count) reader.fail("has a different number of landmarks from 'source'");
  return points;
}

Alignment read_alignment(const Reader& reader, Eigen::Index d) {
  Alignment alignment{parsed(reader.at("kind"), parse_alignment), reader.at("scale").number(), {}, {}};
  const std::string linear = reader.has("rotation") ? "rotation" : "linear";  // the first is its name in old records
  alignment.linear = reader.at(linear).columns(d).transpose();
  alignment.translation = reader.at("translation").numbers();
  if (alignment.linear.rows() != d || alignment.translation.size() != d)
    reader.at(linear).fail("has a different dimension from 'source'");
  return alignment;
}

DisplacementModel read_kernel_fit(const Reader& reader, const Registration& registration) {
  const KernelOperator kernel = make_kernel(registration.kernel);
  return {kernel.terms().front(),
          registration.lambda,
          reader.at("log_likelihood").number(),
          reader.at("prediction_error").number(),
          reader.at("alignment_error").number(),
          reader.at("landmarks").count()};
}

std::vector<PhaseState> read_states(const Reader& reader, const Registration& registration) {
  const std::vector<Reader> positions = reader.at("positions").items(), momenta = reader.at("momenta").items();
  const auto count = static_cast<std::size_t>(registration.grid.steps) + 1;
  if (positions.size() != count || momenta.size() != count) reader.fail("lacks the states of each step and of the end");
  const Points& q0 = registration.source.points;
  std::vector<PhaseState> states;
  for (std::size_t k = 0; k < count; ++k)
    states.push_back({same_size(positions[k], q0.rows(), q0.cols()), same_size(momenta[k], q0.rows(), q0.cols())});
  return states;
}

void read_setting(const Reader& reader, Registration& registration) {
  registration.kernel = reader.at("kernel").text();
  registration.noise = reader.at("noise").text();
  registration.mode = parsed(reader.at("mode"), parse_mode);
  registration.integrator = reader.at("integrator").text();
  parsed(reader.at("integrator"), [](const std::string& name) { return make_integrator(name) != nullptr; });
  registration.grid = {reader.at("time").number(), reader.at("steps").count()};
  registration.sigma = reader.at("sigma").number();
  registration.lambda = reader.at("lambda").number();
}

void read_outcome(const Reader& reader, Registration& registration) {
  registration.cost = read_cost(reader.at("cost"));
  registration.solver = parsed(reader.at("solver"), parse_solver);
  registration.converged = reader.at("converged").boolean();
  if (reader.has("step_error"))
    registration.step_error = {reader.at("step_error").at("rms").number(), reader.at("step_error").at("cost").number()};
  if (reader.has("amplification")) registration.amplification = reader.at("amplification").number();
  registration.stop_reason = reader.at("stop_reason").text();
  registration.iterations = reader.at("iterations").count();
  registration.evaluations = reader.at("evaluations").count();
  registration.relative_gradient = reader.at("relative_gradient").number();
  registration.seconds = reader.at("seconds").number();
  if (!reader.has("unknowns")) return;  // an old record
  registration.seed = reader.at("seed").seed();
  registration.samples = reader.at("samples").count();
  registration.unknowns = reader.at("unknowns").count();
  registration.notes = reader.at("notes").texts();
}

}  // namespace

Registration read_registration(const std::filesystem::path& path, const NoiseTable* own) {
  const std::string file = path.string();
  const nlohmann::json json = io::parse_json(file, io::read_text_file(path));
  const Reader reader(json, file);
  Registration registration;
  read_setting(reader, registration);
  read_outcome(reader, registration);
  const Eigen::Index d = first_row_size(reader.at("source"));
  const Points source = reader.at("source").columns(d);
  registration.original = read_shape(reader.at("source_shape"), same_size(reader.at("original"), d, source.cols()));
  if (reader.has("data")) registration.data = read_data(reader.at("data"), d);
  const bool corresponds = registration.data.kind == DataKind::kLandmarks;
  Points target = reader.at("target").columns(d, true);
  if (corresponds && target.cols() != source.cols())
    reader.at("target").fail("has a different number of landmarks from 'source'");
  registration.target = read_shape(reader.at("target_shape"), std::move(target));
  registration.source = registration.original;
  registration.source.points = source;
  registration.alignment = read_alignment(reader.at("alignment"), d);
  registration.result = same_size(reader.at("result"), d, source.cols());
  if (reader.has("spread")) registration.spread = same_size(reader.at("spread"), d, source.cols());
  registration.momenta = same_size(reader.at("momenta"), d, source.cols());
  parsed(reader.at("kernel"), [&](const std::string& spec) { return make_kernel(spec, source).at_zero(); });
  const int channels = parsed(reader.at("noise"), [&](const std::string& spec) {
    const auto noise = make_noise(spec, registration.source, own ? *own : noise_table());
    if (own) registration.own_noise = noise;
    noise->check(static_cast<int>(d), static_cast<int>(source.cols()));
    return noise->channels(static_cast<int>(d), static_cast<int>(source.cols()));
  });
  if (reader.has("kernel_fit")) registration.fitted_kernel = read_kernel_fit(reader.at("kernel_fit"), registration);
  registration.increments = reader.at("increments").columns(channels);
  if (registration.grid.steps < 1 || registration.increments.cols() != registration.grid.steps)
    reader.at("increments").fail("has a different number of rows from 'steps'");
  if (reader.has("states")) registration.states = read_states(reader.at("states"), registration);
  return registration;
}

}  // namespace pulson
