#include "arguments.hpp"

#include <fmt/format.h>

#include "core/text.hpp"
#include "formats/text/newick.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "shell/cohort_shapes.hpp"
#include "shell/help_groups.hpp"
#include "shell/path_options.hpp"

namespace pulson {

void SampleArguments::add_to(CLI::App& verb) {
  reads_shape(
      verb.add_option("SOURCE", source, "shape: file, file#3 (from 1) or file#id=NAME; with --tree it may be left out"))
      ->required();
  reads_shape(verb.add_option(
      "TARGET", targets,
      "shapes, each an independent path from SOURCE; with --tree those of its nodes; a file may hold several"));
  add_read_options(verb, reading);
  add_order_option(verb, by_order);
  add_flip_option(verb, reading);
  output.add_to(verb, "paths.png, chains.png and their .svg");
  begin_group(verb, kModelGroup);
  const auto by_task = [](matching::Default matching::TaskDefaults::*setting) {
    const matching::TaskDefaults& cohort = matching::sample_cohort_defaults();
    return fmt::format("[{}; of several targets {}]", (matching::sample_defaults().*setting).value,
                       (cohort.*setting).value);
  };
  verb.add_option("--kernel", kernel,
                  "kernel, see pulson info kernels; auto: matern32 of the width with the greatest likelihood; "
                  "alpha=fit: sampled, too " +
                      by_task(&matching::TaskDefaults::kernel))
      ->type_name("SPEC");
  verb.add_option("--noise", noise,
                  "noise model, see pulson info noises; beta=fit: sampled, too; 2%:fit(0.5): with a log-normal prior "
                  "about 2 % with this deviation of the logarithm [0.5; of alpha and sigma 0.25]")
      ->type_name("SPEC")
      ->capture_default_str();
  verb.add_option("--sigma", sigma,
                  "standard deviation of a landmark's position: a length, or per cent of the source's diameter; fit: "
                  "sampled, too " +
                      by_task(&matching::TaskDefaults::sigma))
      ->type_name("LENGTH");
  verb.add_option("--lambda", lambda,
                  "inverse variance of the momenta; auto: fitted with --kernel auto, else 1/diameter^2 of the source; "
                  "fit: sampled, too " +
                      by_task(&matching::TaskDefaults::lambda))
      ->type_name("NUMBER");
  loss.add_to(verb,
              "of landmarks in place of least squares: their weights are found before the chains, and held; sigma is "
              "then fitted, and at least --sigma; for one target");
  begin_group(verb, kModelGroup);
  reads_file(verb.add_option("--tree", tree,
                             "a phylogeny in Newick format: SOURCE is the shape at its root, else estimated by "
                             "generalised least squares; noise moves it along the branches, and each TARGET is the "
                             "shape of the node with its name"));
  only_known(verb.add_option("--align", align,
                             "transformation removed first: none, translation, rigid, similarity, affine; auto: "
                             "similarity in the plane and in space, none on a line and with --tree")
                 ->type_name("NAME")
                 ->capture_default_str(),
             "alignment", {"auto"});
  begin_group(verb, more(kModelGroup));
  verb.add_option(
          "--momenta", momenta,
          "prior of the momenta: kernel: N(0, (lambda K)^-1); smooth: the same, but those that move landmarks by less "
          "than three deviations of noise and sigma fade, for dense outlines")
      ->type_name("NAME")
      ->capture_default_str();
  verb.add_option("--integrator", integrator, "see pulson info integrators")->type_name("NAME")->capture_default_str();
  begin_group(verb, kSamplingGroup);
  verb.add_option("--method", sampler.method,
                  fmt::format("Markov chains: {}", fmt::join(names_in(inference::sampler_table()), ", ")))
      ->type_name("NAME")
      ->capture_default_str();
  verb.add_option("--chains", sampler.chains, "number of chains")->capture_default_str();
  verb.add_option("--draws", sampler.draws, "draws of each chain")->capture_default_str();
  verb.add_option("--warmup", sampler.warmup, "iterations of each chain that adapt and are not kept")
      ->capture_default_str();
  begin_group(verb, more(kSamplingGroup));
  verb.add_option("--searches", sampler.searches,
                  "searches for modes, from different initial guesses; 0: 16 for up to 12 coordinates, else 1")
      ->capture_default_str();
  verb.add_option("--temperatures", sampler.temperatures,
                  "parallel tempering: each chain exchanges points with chains of as many tempered posteriors, down to "
                  "independent draws; for several modes and strongly bent paths, at that many times the cost")
      ->type_name("COUNT")
      ->capture_default_str();
  verb.add_option("--keep-paths", sampler.paths_kept, "number of paths in paths.npy")->capture_default_str();
  begin_group(verb, "Calibration");
  verb.add_option("--calibrate", calibrate,
                  "simulation-based calibration instead: shapes drawn from the prior, and ranks of the true values "
                  "among the posterior's draws")
      ->type_name("COUNT");
  begin_group(verb, more("Calibration"));
  verb.add_option("--ranks", ranks, "thinned draws of each simulation, among which values are ranked")
      ->capture_default_str();
  verb.add_option("--fault", fault,
                  "with --calibrate: draw the shapes with this parameter times FACTOR, to see that it is caught")
      ->type_name("NAME=FACTOR");
  units.add_to(verb, "simulations of --calibrate, or the chains");
  begin_group(verb, kSamplingGroup);
  add_seed_option(verb, sampler.seed);
  begin_group(verb, more(kModelGroup));
  time.add_to(verb, "1");
  begin_group(verb, more(kSamplingGroup));
  add_threads_option(verb);
}

namespace {
constexpr int kFewestSteps = 4;  // of those that are chosen: even, for q(T/2)
}  // namespace

nlohmann::ordered_json tree_facts(const std::vector<TreeNode>& tree) {
  nlohmann::ordered_json nodes = nlohmann::ordered_json::array();
  for (const TreeNode& node : tree) nodes.push_back({node.name, node.parent, node.length});
  return nodes;
}

SampleShapes SampleArguments::read(std::vector<std::string>& notes) const {
  if (calibrate <= 0 && !units.shard.empty()) throw InputError("--shard is for the simulations of --calibrate");
  if (targets.empty() && tree.empty())
    throw InputError("no TARGET is given; only the root of --tree is estimated from the other shapes");
  const bool has_root = !targets.empty();
  SampleShapes shapes{{}, read_shapes(has_root ? targets : std::vector<std::string>{source}, reading, notes), {}};
  if (!tree.empty()) shapes.tree = formats::parse_newick(tree, text::read_text_file(tree));
  for (const Landmarks& target : shapes.targets) require_digitised(target);
  shapes.source = has_root ? read_landmarks(source, &notes, reading) : shapes.targets.front();
  require_digitised(shapes.source);
  put_in_order_of(shapes.source, shapes.targets, by_order, notes);
  if (has_root) return shapes;
  shapes.source = inference::brownian_root(shapes.tree, shapes.targets);
  notes.emplace_back(fmt::format("the shape at the root is estimated from {} shapes by generalised least squares",
                                 shapes.targets.size()));
  return shapes;
}

const matching::TaskDefaults& SampleArguments::defaults(const SampleShapes& shapes) const {
  if (!shapes.tree.empty()) return matching::sample_tree_defaults();
  return shapes.targets.size() == 1 ? matching::sample_defaults() : matching::sample_cohort_defaults();
}

OpenModel SampleArguments::model(const matching::TaskDefaults& usual) const {
  const auto given = [](const std::string& text, const matching::Default& otherwise) {
    return text.empty() ? otherwise.value : text;
  };
  return {given(kernel, usual.kernel), noise, given(sigma, usual.sigma), given(lambda, usual.lambda)};
}

inference::PosteriorProblem SampleArguments::problem(const SampleShapes& shapes,
                                                     std::vector<std::string>& notes) const {
  static_cast<void>(inference::sampler_table().find(sampler.method));
  check_at_least(sampler.chains, 1, "--chains");
  check_at_least(sampler.draws, 4, "--draws");
  check_at_least(sampler.warmup, 0, "--warmup");
  check_at_least(sampler.searches, 0, "--searches");
  check_at_least(sampler.temperatures, 1, "--temperatures");
  check_at_least(sampler.paths_kept, 2, "--keep-paths");
  check_at_least(calibrate, 0, "--calibrate");
  const OpenModel model = this->model(defaults(shapes));
  matching::RegistrationOptions options;
  model.set(options);
  options.integrator = integrator;
  options.grid = time.grid();
  if (time.is_automatic()) options.grid.steps = kFewestSteps;
  if (align != "auto") options.align = parse_alignment(align);
  options.loss = loss.chosen();
  const posterior::MomentumPrior prior = posterior::kMomentumPriors.parse(momenta);
  if (prior != posterior::MomentumPrior::kKernel && !shapes.tree.empty())
    throw InputError("--momenta is the prior of momenta, which shapes of --tree do not have");
  if (options.loss && !shapes.tree.empty()) throw InputError("--loss is for one target, not for the shapes of --tree");
  model.set_noise(shapes.source, shapes.targets, options);
  inference::PosteriorProblem made =
      shapes.tree.empty()
          ? inference::make_posterior_problem(shapes.source, shapes.targets, options, model.priors())
          : inference::make_tree_problem(shapes.source, shapes.tree, shapes.targets, options, model.priors());
  made.momenta = prior;
  notes.insert(notes.end(), made.notes.begin(), made.notes.end());
  log_step(fmt::format("fitted: kernel {}", made.specimens.front().system.kernel.spec(4)));
  if (!time.is_automatic()) return made;
  made = with_sufficient_steps(std::move(made), sampler.seed);
  log_step(fmt::format("chose {} steps", made.specimens.front().grid.steps));
  return made;
}

inference::CalibrationOptions SampleArguments::calibration() const {
  check_at_least(ranks, 1, "--ranks");
  inference::CalibrationOptions options{sampler, calibrate, ranks, {}, 1};
  if (sampler.draws < ranks)
    throw InputError(fmt::format("--draws is {}; it must be at least --ranks, {}", sampler.draws, ranks));
  if (fault.empty()) return options;
  const std::size_t equals = fault.find('=');
  if (equals == std::string::npos)
    throw InputError(fmt::format("--fault is '{}'; give NAME=FACTOR, as in beta=1.2", fault));
  options.fault_name = fault.substr(0, equals);
  options.fault_factor = parse_number(std::string_view(fault).substr(equals + 1), "--fault");
  require_positive("--fault", options.fault_factor);
  return options;
}

}  // namespace pulson
