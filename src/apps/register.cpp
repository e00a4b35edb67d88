// `pulson register`: fits momenta, and noise, so that a source flows to a target.

#include <memory>
#include <optional>

#include <fmt/core.h>

#include "options.hpp"
#include "outputs.hpp"
#include "pulson/io/atomic_file.hpp"
#include "pulson/io/landmark_files.hpp"
#include "pulson/io/registration_record.hpp"
#include "pulson/warp/triangulation.hpp"
#include "register_picture.hpp"
#include "verbs.hpp"

namespace pulson {
namespace {

struct RegisterArguments {
  std::string source;
  std::string target;
  OutputOptions output;
  RegistrationOptions options;
  TimeOptions time;
  std::optional<std::string> mode;
  std::string lambda = "1";
  std::string align = "none";
  std::string solver = "auto";
};

const std::vector<std::string> kFiles = {"registration.json", "residuals.csv", "trajectory.csv"};
const std::vector<std::string> kPictures = {"registration.png", "registration.svg"};

void add_matching_options(CLI::App& verb, RegisterArguments& arguments) {
  RegistrationOptions& options = arguments.options;
  verb.add_option("--kernel", options.kernel, "kernel, see pulson info kernels")->capture_default_str();
  verb.add_option("--noise", options.noise, "noise model, see pulson info noises")->capture_default_str();
  verb.add_option("--mode", arguments.mode,
                  "deterministic, or map: the noise is fitted too [map where there is noise]");
  verb.add_option("--integrator", options.integrator, "see pulson info integrators")->capture_default_str();
  verb.add_option("--sigma", options.sigma, "standard deviation of a landmark's place, length units")
      ->capture_default_str();
  verb.add_option("--lambda", arguments.lambda, "weight of the energy; auto: 1/diameter^2 of the source")
      ->capture_default_str();
  verb.add_option("--align", arguments.align, "motion taken out first: none, translation, rigid, similarity")
      ->capture_default_str();
  verb.add_option("--solver", arguments.solver, "gauss-newton, lbfgs or auto")->capture_default_str();
  verb.add_option("--tolerance", options.minimise.gradient_tolerance, "relative gradient that counts as converged")
      ->capture_default_str();
  verb.add_option("--max-iterations", options.minimise.max_iterations, "of the solver, from each start")
      ->capture_default_str();
}

RegistrationOptions registration_options(const RegisterArguments& arguments) {
  RegistrationOptions options = arguments.options;
  options.grid = arguments.time.grid();
  if (arguments.mode) options.mode = parse_mode(*arguments.mode);
  options.lambda = std::nullopt;
  if (arguments.lambda != "auto") options.lambda = parse_number(arguments.lambda, "--lambda");
  options.align = parse_alignment(arguments.align);
  options.minimise.solver = parse_solver(arguments.solver);
  if (options.minimise.max_iterations < 0)
    throw InputError(fmt::format("--max-iterations is {}; it must not be negative", options.minimise.max_iterations));
  if (!(options.minimise.gradient_tolerance > 0))
    throw InputError(fmt::format("--tolerance is {}; it must be greater than 0", options.minimise.gradient_tolerance));
  return options;
}

TopologyCounts topology_counts(const Registration& registration) {
  TopologyCounts counts;
  const Points& source = registration.source.points;
  if (source.rows() == 1) counts.order_inversions = order_inversions(source, registration.result);
  if (source.rows() == 2) counts.flipped_triangles = flipped_triangles(source, registration.result);
  return counts;
}

// "1 pair of landmarks", "2 pairs of landmarks".
std::string counted(int count, std::string_view noun, std::string_view rest = {}) {
  return fmt::format("{} {}{}{}{}", count, noun, count == 1 ? "" : "s", rest.empty() ? "" : " ", rest);
}

void print_summary(const Registration& registration, const TopologyCounts& counts) {
  int worst = 0;
  registration.distances().maxCoeff(&worst);
  fmt::print("{} → {}: {} in {}D\n", registration.original.source, registration.target.source,
             counted(registration.source.count(), "landmark"), registration.source.dimension());
  if (registration.alignment.kind != AlignmentKind::kNone)
    fmt::print("aligned    {}, scale {:.4g}\n", alignment_name(registration.alignment.kind),
               registration.alignment.scale);
  fmt::print("model      {}, noise {}, mode {}, {} steps, sigma {:.4g}, lambda {:.4g}\n",
             registration_system(registration).kernel.spec(4), registration.noise, mode_name(registration.mode),
             registration.grid.steps, registration.sigma, registration.lambda);
  fmt::print("{} {} iterations of {} in {:.2f} s: {} (relative gradient {:.1e})\n",
             registration.converged ? "converged " : "STOPPED   ", registration.iterations,
             solver_name(registration.solver), registration.seconds, registration.stop_reason,
             registration.relative_gradient);
  fmt::print("rms        {:.4g} (was {:.4g}), largest {:.4g} at landmark {}\n", registration.rms(),
             registration.initial_rms(), registration.max_residual(), registration.source.describe(worst));
  fmt::print("cost       {:.4g} = energy {:.4g} + action {:.4g} + data {:.4g}\n", registration.cost.total(),
             registration.cost.energy, registration.cost.action, registration.cost.data);
  if (counts.order_inversions)
    fmt::print("topology   {} changed order\n", counted(*counts.order_inversions, "pair", "of landmarks"));
  if (counts.flipped_triangles)
    fmt::print("topology   {} turned over\n", counted(*counts.flipped_triangles, "Delaunay triangle"));
}

// Why the shapes stayed apart, as far as the numbers tell.
std::string advice(const Registration& registration) {
  const bool still = registration.noise == "none";
  const std::string noise = "try --noise ch-sd:beta=B, with B a part of the distance that landmarks have to go";
  if (registration.source.dimension() == 1 && still)
    if (const int pairs = order_inversions(registration.source.points, registration.target.points); pairs > 0)
      return fmt::format("{} another order in the target, which no flow can reach: {}",
                         counted(pairs, "pair", pairs == 1 ? "of landmarks has" : "of landmarks have"), noise);
  if (!registration.converged) return "more --steps or --max-iterations may help" + (still ? "; or " + noise : "");
  return "a smaller --sigma or --lambda fits closer" + (still ? "; for shapes that no flow can match " + noise : "");
}

void print_warnings(const Registration& registration, const RegisterArguments& arguments) {
  if (registration.noise == "none" && arguments.options.noise != "none")
    fmt::print(stderr, "note: mode deterministic does not use the noise '{}'\n", arguments.options.noise);
  if (!registration.converged)
    fmt::print(stderr, "warning: not converged: {} after {} iterations\n", registration.stop_reason,
               registration.iterations);
  if (!registration.matched())
    fmt::print(stderr, "warning: not matched: rms {:.4g} is {:.0f} sigma and {:.0f} % of what it was; {}\n",
               registration.rms(), registration.rms() / registration.sigma,
               100 * registration.rms() / registration.initial_rms(), advice(registration));
}

void write_results(const Registration& registration, const TopologyCounts& counts, const OutputOptions& output) {
  const Trajectory path = replay(registration);
  const std::string record = registration_json(registration, counts);
  write_file_atomically(output.file("registration.json"), record);
  write_file_atomically(output.file("residuals.csv"), residuals_csv(registration));
  write_file_atomically(output.file("trajectory.csv"), trajectory_csv(registration, path));
  output.write_json(record);
  if (!output.no_picture)
    write_registration_picture(make_registration_picture(registration, path), output.file("registration.png"),
                               output.file("registration.svg"));
}

int run_register(const RegisterArguments& arguments) {
  std::vector<std::string> notes;
  const Landmarks source = read_landmarks(arguments.source, &notes);
  const Landmarks target = read_landmarks(arguments.target, &notes);
  RegistrationOptions options = registration_options(arguments);
  Progress progress;
  options.minimise.on_iteration = [&](int iteration, double cost, double gradient) {
    progress.show(fmt::format("iteration {}: cost {:.6g}, relative gradient {:.1e}", iteration, cost, gradient));
  };
  arguments.output.check(kFiles, kPictures);
  const Registration registration = register_shapes(source, target, options);
  const TopologyCounts counts = topology_counts(registration);
  write_results(registration, counts, arguments.output);
  for (const std::string& note : notes) fmt::print(stderr, "note: {}\n", note);
  if (arguments.output.prints()) {
    print_summary(registration, counts);
    arguments.output.print_written(kFiles, kPictures);
  }
  print_warnings(registration, arguments);
  return registration.converged ? kDone : kNotConverged;
}

}  // namespace

void add_register_verb(CLI::App& program, int& exit_code) {
  CLI::App* verb = program.add_subcommand("register", "Fit momenta, and noise, so that SOURCE flows to TARGET");
  auto arguments = std::make_shared<RegisterArguments>();
  verb->add_option("SOURCE", arguments->source, "shape: file, file#3 (from 1) or file#id=NAME")->required();
  verb->add_option("TARGET", arguments->target, "shape that it should become")->required();
  arguments->output.add_to(*verb, "registration.png and .svg", "-q,--quiet");
  add_matching_options(*verb, *arguments);
  arguments->time.add_to(*verb, "1");
  add_threads_option(*verb);
  verb->footer(
      "Examples:\n"
      "  pulson register a.csv b.csv -o out\n"
      "  pulson register skulls.tps#1 skulls.tps#2 -o out --align similarity --kernel gaussian:alpha=auto\n"
      "  pulson register a.csv b.csv -o out --noise ch-sd:beta=0.3\n"
      "Exit codes: 0 done, 2 bad input, 3 not converged (results are written).");
  verb->callback([arguments, &exit_code] { exit_code = run_register(*arguments); });
}

}  // namespace pulson
