#include "start_options.hpp"

#include <fmt/core.h>

#include "core/landmark_pairs.hpp"
#include "core/landmark_range.hpp"
#include "matching/defaults.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/noise/noise_table.hpp"
#include "pulson/records/records.hpp"
#include "register/registration_warnings.hpp"
#include "shell/help_groups.hpp"
#include "shell/host.hpp"
#include "shell/path_options.hpp"

namespace pulson {
namespace {

constexpr double kLongTime = 100;  // of the paper's runs

// `0,10` or `0/0,1/0`: landmarks apart by commas, coordinates by strokes.
Points parse_points(std::string_view text, std::string_view option) {
  std::vector<std::vector<double>> columns;
  for (std::size_t begin = 0; begin <= text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    columns.push_back(parse_number_list(text.substr(begin, end - begin), option));
    begin = end + 1;
  }
  const std::size_t d = columns.front().size();
  if (d > 3)
    throw InputError(fmt::format("{}: the first landmark has {} coordinates; 1, 2 or 3 are needed", option, d));
  Points points(static_cast<Eigen::Index>(d), static_cast<Eigen::Index>(columns.size()));
  for (std::size_t a = 0; a < columns.size(); ++a) {
    if (columns[a].size() != d)
      throw InputError(fmt::format("{}: landmark {} has a different number of coordinates from the first ({} and {})",
                                   option, a + 1, columns[a].size(), d));
    points.col(static_cast<Eigen::Index>(a)) = Eigen::Map<const Eigen::VectorXd>(columns[a].data(), points.rows());
  }
  if (!points.allFinite()) throw InputError(fmt::format("{}: '{}' has a number that is not finite", option, text));
  return points;
}

void check_same_size(const Points& p, const Points& q, const std::string& what) {
  if (p.rows() != q.rows() || p.cols() != q.cols())
    throw InputError(fmt::format("{} has {} landmarks in {}D, the positions {} in {}D", what, p.cols(), p.rows(),
                                 q.cols(), q.rows()));
}

void check_momenta(const Points& p, const std::string& option) {
  constexpr double kLargestMomentum = 1e100;  // squares stay in the range of numbers
  if (const double largest = p.cwiseAbs().maxCoeff(); !(largest <= kLargestMomentum))
    throw InputError(
        fmt::format("{}: a momentum is {}; at most {} in size is supported", option, largest, kLargestMomentum));
}

// Momenta are no places: what belongs to those of the shape is not applied to them.
formats::ReadOptions of_vectors(const formats::ReadOptions& reading) {
  return {.columns = reading.columns, .dimension = reading.dimension, .landmarks = reading.landmarks};
}

void check_complete(const Landmarks& shape) {
  if (const std::vector<int> incomplete = incomplete_points(shape.points); !incomplete.empty())
    throw InputError(fmt::format("{}: landmark {} has a missing coordinate; a complete shape is needed", shape.source,
                                 shape.describe(incomplete.front())));
}

void check_distinct(const Landmarks& shape) {
  if (const auto pair = find_coincident(shape.points); pair && shape.count() > 1)
    throw InputError(fmt::format("{}: landmarks {} and {} are at the same position", shape.source,
                                 shape.describe(pair->first), shape.describe(pair->second)));
}

}  // namespace

void StartOptions::add_to(CLI::App& verb) {
  begin_group(verb, kInputGroup);
  CLI::Option* by_q = verb.add_option("--q", q, "positions: 0,10 on a line, 0/0,1/0 in the plane, 0/0/0,… in space")
                          ->type_name("NUMBERS");
  CLI::Option* by_shape =
      reads_shape(verb.add_option("--shape", shape, "positions from a landmark file, file#3 or file#id=NAME"));
  CLI::Option* by_from =
      reads_file(verb.add_option("--from", from, "positions, momenta, kernel and noise of a registration.json"));
  by_q->excludes(by_shape, by_from);
  by_shape->excludes(by_from);
  CLI::Option* by_p = verb.add_option("--p", p, "momenta, in the format of --q [0]")->type_name("NUMBERS");
  reads_shape(verb.add_option("--momenta", momenta, "momenta from a landmark file [0]"))->excludes(by_p);
  add_read_options(verb, reading);
  add_order_option(verb, by_order);
  begin_group(verb, kModelGroup);
  verb.add_option("--kernel", kernel,
                  fmt::format("see pulson info kernels [{}]", matching::path_defaults().kernel.value))
      ->type_name("SPEC");
  verb.add_option("--noise", noise, "see pulson info noises [none]")->type_name("SPEC");
}

namespace {

std::shared_ptr<const NoiseModel> noise_named(const std::string& spec, const Landmarks& shape) {
  const bool is_own = host() != nullptr && host()->noise && host()->noise->spec() == spec;
  return is_own ? host()->noise : make_noise(spec, shape);
}

}  // namespace

Start StartOptions::start() const {
  Start start;
  std::string kernel_spec = matching::path_defaults().kernel.value;
  std::string noise_spec = "none";
  if (from) {
    const matching::Registration registration = records::read_registration(*from);
    for (const std::string& text : momenta_warnings(registration))
      start.notes.push_back("of the registration: " + text);
    start.shape = registration.source;
    start.shape.source = *from;
    start.state = {registration.source.points, registration.momenta};
    start.default_time = registration.grid.time;
    kernel_spec = registration.kernel;
    noise_spec = registration.noise;
  } else if (shape) {
    start.shape = read_landmarks(*shape, &start.notes, reading);
  } else if (q) {
    start.shape.points = parse_points(*q, "--q");
    start.shape.source = "--q";
    start.default_time = kLongTime;
  } else {
    throw InputError("an initial state is needed: --q, --shape or --from");
  }
  if (reading.y_down) start.shape.frame.y_down = *reading.y_down && start.shape.dimension() == 2;
  check_complete(start.shape);
  require_usable_range(start.shape);
  check_distinct(start.shape);
  if (!from) start.state = {start.shape.points, Points::Zero(start.shape.points.rows(), start.shape.points.cols())};
  if (p) start.state.p = parse_points(*p, "--p");
  if (momenta) {
    Landmarks vectors = read_landmarks(*momenta, &start.notes, of_vectors(reading));
    if (vectors.count() == start.shape.count())
      vectors = in_order_of(start.shape, vectors, start.notes, by_order ? PairBy::kOrder : PairBy::kNames);
    check_complete(vectors);
    start.state.p = vectors.points;
  }
  check_same_size(start.state.p, start.state.q, p ? "--p" : "--momenta");
  check_momenta(start.state.p, p ? "--p" : momenta ? "--momenta" : "--from");
  start.system = {make_kernel(kernel.value_or(kernel_spec), start.shape.points),
                  noise_named(noise.value_or(noise_spec), start.shape)};
  start.system.noise->check(start.shape.dimension(), start.shape.count());
  return start;
}

}  // namespace pulson
