#include <cmath>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "core/text.hpp"
#include "csv_rows.hpp"
#include "formats/frame_text.hpp"
#include "formats/json/json_reader.hpp"
#include "noise_channels.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/version.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/records/records.hpp"
#include "record_text.hpp"
#include "registration_facts.hpp"
#include "verdicts_json.hpp"

namespace pulson::records {

namespace {

using Reader = formats::JsonValue;

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
  if (reader.has("frame")) shape.frame = formats::read_frame(reader.at("frame"));
  if (reader.has("units")) shape.units = reader.at("units").text();
  if (reader.has("links")) shape.links = reader.at("links").links(shape.count(), 1);
  for (const auto& [key, size] :
       {std::pair("numbers", shape.numbers.size()), {"labels", shape.labels.size()}, {"groups", shape.groups.size()}})
    if (size > 0 && size != static_cast<std::size_t>(shape.count()))
      reader.at(key).fail("does not have the length of the shape");
  return shape;
}

matching::DataOptions read_data(const Reader& reader, Eigen::Index d) {
  matching::DataOptions data;
  data.kind = parsed(reader.at("kind"), matching::parse_data_kind);
  if (reader.has("ends")) data.ends = parsed(reader.at("ends"), matching::parse_curve_ends);
  if (reader.has("width")) data.width = reader.at("width").number();
  if (reader.has("weights")) data.weights = reader.at("weights").numbers();
  if (reader.has("covariances"))
    for (const Reader& item : reader.at("covariances").items()) data.covariances.push_back(item.columns(d));
  return data;
}

matching::RobustWeights read_robust(const Reader& reader, Eigen::Index count) {
  matching::RobustWeights robust{reader.at("loss").text(), reader.at("weights").numbers()};
  if (robust.weights.size() != count) reader.at("weights").fail("does not have the length of the shape");
  return robust;
}

matching::MatchingCost read_cost(const Reader& cost) {
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

matching::DisplacementModel read_kernel_fit(const Reader& reader, const matching::Registration& registration) {
  const KernelOperator kernel = make_kernel(registration.kernel);
  return {kernel.terms().front(),
          registration.lambda,
          reader.at("log_likelihood").number(),
          reader.at("prediction_error").number(),
          reader.at("alignment_error").number(),
          reader.at("landmarks").count()};
}

std::vector<PhaseState> read_states(const Reader& reader, const matching::Registration& registration) {
  const std::vector<Reader> positions = reader.at("positions").items(), momenta = reader.at("momenta").items();
  const auto count = static_cast<std::size_t>(registration.grid.steps) + 1;
  if (positions.size() != count || momenta.size() != count) reader.fail("lacks the states of each step and of the end");
  const Points& q0 = registration.source.points;
  std::vector<PhaseState> states;
  for (std::size_t k = 0; k < count; ++k)
    states.push_back({same_size(positions[k], q0.rows(), q0.cols()), same_size(momenta[k], q0.rows(), q0.cols())});
  return states;
}

void read_setting(const Reader& reader, matching::Registration& registration) {
  registration.kernel = reader.at("kernel").text();
  registration.noise = reader.at("noise").text();
  registration.mode = parsed(reader.at("mode"), matching::parse_mode);
  registration.integrator = reader.at("integrator").text();
  parsed(reader.at("integrator"), [](const std::string& name) { return make_integrator(name) != nullptr; });
  registration.grid = {reader.at("time").number(), reader.at("steps").count()};
  registration.sigma = reader.at("sigma").number();
  registration.lambda = reader.at("lambda").number();
}

void read_outcome(const Reader& reader, matching::Registration& registration) {
  registration.cost = read_cost(reader.at("cost"));
  registration.solver = parsed(reader.at("solver"), matching::parse_solver);
  registration.converged = reader.at("converged").boolean();
  if (reader.has("step_error"))
    registration.step_error = {reader.at("step_error").at("rms").number(), reader.at("step_error").at("cost").number()};
  if (reader.has("extrapolated")) {
    const Reader extrapolated = reader.at("extrapolated");
    registration.extrapolated = {read_cost(extrapolated.at("cost")), extrapolated.at("coarse_steps").count(),
                                 extrapolated.at("error").number()};
  }
  if (reader.has("noise_displacement")) registration.noise_displacement = reader.at("noise_displacement").number();
  if (reader.has("amplification")) registration.amplification = reader.at("amplification").number();
  if (reader.has("minima"))
    for (const Reader& minimum : reader.at("minima").items())
      registration.minima.push_back(
          {minimum.at("total").number(), minimum.at("found").count(), minimum.at("log_weight").number()});
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

matching::Registration read_registration(const std::filesystem::path& path, const NoiseTable* own) {
  return registration_of(text::read_text_file(path), path.string(), own);
}

matching::Registration registration_of(std::string_view text, const std::string& file, const NoiseTable* own) {
  const nlohmann::json json = formats::parse_json(file, text);
  const Reader reader(json, file);
  matching::Registration registration;
  read_setting(reader, registration);
  read_outcome(reader, registration);
  const Eigen::Index d = first_row_size(reader.at("source"));
  const Points source = reader.at("source").columns(d);
  registration.original = read_shape(reader.at("source_shape"), same_size(reader.at("original"), d, source.cols()));
  if (reader.has("data")) registration.data = read_data(reader.at("data"), d);
  if (reader.has("loss")) registration.robust = read_robust(reader, source.cols());
  const bool corresponds = registration.data.kind == matching::DataKind::kLandmarks;
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

namespace {

template <class Value>
formats::Json optional_json(const std::optional<Value>& value) {
  return value ? formats::Json(*value) : formats::Json(nullptr);
}

formats::Json shape_json(const Landmarks& shape) {
  formats::Json json = {
      {"file", shape.source}, {"name", shape.name}, {"labels", shape.labels}, {"groups", shape.groups}};
  if (!shape.numbers.empty()) json["numbers"] = shape.numbers;
  if (!shape.links.empty()) json["links"] = formats::links_json(shape.links);
  if (!shape.axes.empty()) json["axes"] = shape.axes;
  if (!shape.units.empty()) json["units"] = shape.units;
  if (shape.dimension() == 2) json["frame"] = formats::frame_json(shape.frame);
  return json;
}

formats::Json kernel_fit_json(const matching::DisplacementModel& model) {
  return {{"log_likelihood", model.log_likelihood},
          {"prediction_error", model.prediction_error},
          {"alignment_error", model.alignment_error},
          {"landmarks", model.landmarks}};
}

formats::Json alignment_json(const Alignment& alignment) {
  return {{"kind", alignment_name(alignment.kind)},
          {"scale", alignment.scale},
          {"linear", formats::points_json(alignment.linear.transpose())},
          {"translation", std::vector<double>(alignment.translation.begin(), alignment.translation.end())}};
}

formats::Json numbers_json(const Eigen::VectorXd& numbers) {
  return std::vector<double>(numbers.begin(), numbers.end());
}

formats::Json data_json(const matching::DataOptions& data) {
  formats::Json json = {{"kind", data_kind_name(data.kind)}};
  if (data.kind != matching::DataKind::kLandmarks) json["ends"] = curve_ends_name(data.ends);
  if (data.width) json["width"] = *data.width;
  if (data.weights.size() > 0) json["weights"] = numbers_json(data.weights);
  for (const Eigen::MatrixXd& covariance : data.covariances)
    json["covariances"].push_back(formats::points_json(covariance));
  return json;
}

formats::Json cost_json(const matching::MatchingCost& cost) {
  return {{"total", cost.total()}, {"energy", cost.energy}, {"action", cost.action}, {"data", cost.data}};
}

formats::Json shares_json(const matching::Registration& registration, const matching::LandmarkShares& shares) {
  formats::Json json = formats::Json::object();
  if (const auto part = noise_fraction(registration, shares)) json["noise_part"] = *part;
  if (shares.flow.size() > 0) json["flow"] = formats::points_json(shares.flow);
  if (shares.noise.size() > 0) json["noise"] = formats::points_json(shares.noise);
  if (shares.energy.size() > 0) json["energy"] = numbers_json(shares.energy);
  if (shares.action.size() > 0) json["action"] = numbers_json(shares.action);
  if (shares.data.size() > 0) json["data"] = defined_or_null(numbers_json(shares.data));
  return json;
}

formats::Json uncertainty_json(const matching::LaplaceApproximation& uncertainty) {
  return {{"momenta", formats::points_json(uncertainty.momentum_deviation)},
          {"velocities", formats::points_json(uncertainty.velocity_deviation)},
          {"result", formats::points_json(uncertainty.end_deviation)},
          {"log_evidence", uncertainty.log_evidence}};
}

formats::Json fitted_json(const inference::FittedParameters& fitted) {
  return {{"names", fitted.names},
          {"values", numbers_json(fitted.values)},
          {"log_deviations", defined_or_null(numbers_json(fitted.log_deviations))},
          {"log_evidence", fitted.log_evidence},
          {"evaluations", fitted.evaluations},
          {"converged", fitted.converged},
          {"note", fitted.note}};
}

formats::Json states_json(const std::vector<PhaseState>& states) {
  formats::Json positions = formats::Json::array(), momenta = formats::Json::array();
  for (const PhaseState& state : states) {
    positions.push_back(formats::points_json(state.q));
    momenta.push_back(formats::points_json(state.p));
  }
  return {{"positions", positions}, {"momenta", momenta}};
}

formats::Json minima_json(const std::vector<matching::Minimum>& minima) {
  formats::Json list = formats::Json::array();
  for (const matching::Minimum& m : minima)
    list.push_back({{"total", m.total}, {"found", m.found}, {"log_weight", m.log_weight}});
  return list;
}

// The least β that matches is null where the first does not.
formats::Json homotopy_json(const matching::Registration& registration,
                            const std::vector<matching::HomotopyStep>& steps) {
  formats::Json values = formats::Json::array();
  for (const matching::HomotopyStep& step : steps)
    values.push_back({{"beta", step.beta},
                      {"cost", cost_json(step.cost)},
                      {"rms", step.rms},
                      {"matched", step.matched},
                      {"unmatched", numbers_of(registration.source, step.unmatched)},
                      {"converged", step.converged},
                      {"iterations", step.iterations}});
  const auto least = least_needed(steps);
  return {{"steps", values},
          {"least_beta", least == steps.end() ? formats::Json() : formats::Json(least->beta)},
          {"diffeomorphic", reaches_diffeomorphism(steps)}};
}

}  // namespace

const Facts<matching::Registration>& registration_facts() {
  using R = matching::Registration;
  static const Facts<R> facts = {
      {"kernel", "kernel", "of the flow", "{}", &R::kernel},
      {"noise", "noise", "the noise model", "{}", &R::noise},
      {"mode", "mode", "which of momenta and noise are searched for", "", [](const R& r) { return mode_name(r.mode); }},
      {"integrator", "integrator", "of the path", "", &R::integrator},
      {"steps", "steps", "of the integrator", "", [](const R& r) { return r.grid.steps; }},
      {"time", "time", "T", "{:.4g}", [](const R& r) { return r.grid.time; }},
      {"sigma", "sigma", "standard deviation of an observed coordinate, length units", "{:.4g}", &R::sigma},
      {"lambda", "lambda", "weight of the energy", "{:.4g}", &R::lambda},
      {"solver", "search", "the solver", "", [](const R& r) { return solver_name(r.solver); }},
      {"converged", "converged", "whether the search converged", "", &R::converged},
      {"matched", "matched", "whether rms is at most 3 sigma and no landmark is further than the largest of N may be",
       "", &R::matched},
      {"stop_reason", "ended", "why the search ended", "", &R::stop_reason},
      {"relative_gradient", "relative gradient", "where the search ended", "{:.1e}", &R::relative_gradient},
      {"iterations", "iterations", "of the search", "", &R::iterations},
      {"evaluations", "evaluations", "of the cost", "", &R::evaluations},
      {"seconds", "seconds", "of the search", "{:.2f}", &R::seconds},
      {"unknowns", "unknowns", "of the search", "", &R::unknowns},
      {"seed", "seed", "of drawn noise", "", &R::seed},
      {"samples", "realisations", "of drawn noise", "", &R::samples},
      {"cost.total", "cost", "J = energy + action + data", "{:.4g}", [](const R& r) { return r.cost.total(); }},
      {"cost.energy", "energy", "(lambda/2) p0'K p0", "{:.4g}", [](const R& r) { return r.cost.energy; }},
      {"cost.action", "action", "1/2 sum |dW|^2/dt", "{:.4g}", [](const R& r) { return r.cost.action; }},
      {"cost.data", "data", "1/2 |q(T) - y|^2/sigma^2", "{:.4g}", [](const R& r) { return r.cost.data; }},
      {"rms", "rms distance after", "root mean square distance of a landmark from its target, length units", "{:.4g}",
       &R::rms},
      {"initial_rms", "rms distance before", "the same of the aligned source", "{:.4g}", &R::initial_rms},
      {"original_rms", "rms distance before the alignment", "the same of the source as given", "{:.4g}",
       &R::original_rms},
      {"max_residual", "largest distance", "of a landmark from its target, length units", "{:.4g}", &R::max_residual}};
  return facts;
}

std::string registration_json(const matching::Registration& registration, const RegistrationFacts& facts) {
  formats::Json json;
  json["format"] = "pulson registration 1";
  json["version"] = version();
  add_facts(json, registration_facts(), registration);
  if (registration.fitted_kernel) json["kernel_fit"] = kernel_fit_json(*registration.fitted_kernel);
  if (registration.step_error)
    json["step_error"] = {{"rms", registration.step_error->rms}, {"cost", registration.step_error->cost}};
  if (const auto& limit = registration.extrapolated)
    json["extrapolated"] = {
        {"cost", cost_json(limit->cost)}, {"coarse_steps", limit->coarse_steps}, {"error", limit->error}};
  if (registration.noise_displacement) json["noise_displacement"] = *registration.noise_displacement;
  if (registration.amplification) json["amplification"] = *registration.amplification;
  json["notes"] = registration.notes;
  json["data"] = data_json(registration.data);
  if (registration.robust) {
    json["loss"] = registration.robust->loss;
    json["weights"] = numbers_json(registration.robust->weights);
  }
  if (!registration.minima.empty()) json["minima"] = minima_json(registration.minima);
  json["shares"] = shares_json(registration, facts.shares);
  add_verdicts(registration, facts, json);
  json["order_inversions"] = optional_json(facts.counts.order_inversions);
  json["flipped_triangles"] = optional_json(facts.counts.flipped_triangles);
  json["alignment"] = alignment_json(registration.alignment);
  if (registration.original.dimension() == 2) json["frame"] = formats::frame_json(registration.original.frame);
  json["source_shape"] = shape_json(registration.original);
  json["target_shape"] = shape_json(registration.target);
  json["original"] = formats::points_json(registration.original.points);
  json["source"] = formats::points_json(registration.source.points);
  json["target"] = defined_or_null(formats::points_json(registration.target.points));
  json["result"] = formats::points_json(registration.result);
  if (registration.uncertainty) json["uncertainty"] = uncertainty_json(*registration.uncertainty);
  if (!facts.homotopy.empty()) json["homotopy"] = homotopy_json(registration, facts.homotopy);
  if (facts.fitted) json["fitted"] = fitted_json(*facts.fitted);
  if (registration.spread.size() > 0) json["spread"] = formats::points_json(registration.spread);
  json["momenta"] = formats::points_json(registration.momenta);
  json["channels"] = channels_json(registration);
  json["increments"] = formats::points_json(registration.increments);
  if (!registration.states.empty()) json["states"] = states_json(registration.states);
  return formats::one_key_a_line(require_finite(json));
}

}  // namespace pulson::records
