#include <algorithm>
#include <cmath>
#include <iterator>

#include <Eigen/Cholesky>
#include <fmt/format.h>

#include "core/determined.hpp"
#include "core/name_matching.hpp"
#include "parameters.hpp"
#include "pulson/core/alignment.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/matching/data_term.hpp"

namespace pulson::inference {
namespace {

std::size_t index_of(int node) { return static_cast<std::size_t>(node); }

std::string words_for(const std::vector<TreeNode>& tree, std::size_t node) {
  return tree[node].name.empty() ? fmt::format("node {} of the tree", node + 1) : quoted_line(tree[node].name);
}

// Time from the root to each node.
std::vector<double> depths_of(const std::vector<TreeNode>& tree) {
  std::vector<double> depths(tree.size(), 0);
  for (std::size_t i = 1; i < tree.size(); ++i) {
    if (!(tree[i].length > 0))
      throw InputError(fmt::format("the branch to {} has the length {}; it must be greater than 0", words_for(tree, i),
                                   tree[i].length));
    depths[i] = depths[index_of(tree[i].parent)] + tree[i].length;
  }
  return depths;
}

std::vector<bool> leaves_of(const std::vector<TreeNode>& tree) {
  std::vector<bool> leaves(tree.size(), true);
  for (std::size_t i = 1; i < tree.size(); ++i) leaves[index_of(tree[i].parent)] = false;
  return leaves;
}

// Of shapes without a node of their name.
[[noreturn]] void fail_without_node(const std::vector<int>& lonely, const NameList& names, const NameList& nodes) {
  std::vector<std::string> of_shapes;
  for (const int s : lonely) of_shapes.push_back(names.names[static_cast<std::size_t>(s)]);
  std::vector<std::string> valid;
  std::copy_if(nodes.names.begin(), nodes.names.end(), std::back_inserter(valid),
               [](const std::string& name) { return !name.empty(); });
  throw InputError(
      fmt::format("the tree has no node {}{}", listed_names(of_shapes), advice_on_name(of_shapes.front(), valid)));
}

// The shape of each node but the root, none where none is given.
std::vector<const Landmarks*> shapes_by_node(const std::vector<TreeNode>& tree, const std::vector<Landmarks>& shapes,
                                             std::vector<std::string>& notes) {
  NameList names{"the shapes", {}}, nodes{"the tree", {}};
  for (const Landmarks& shape : shapes) names.names.push_back(shape.name);
  for (std::size_t i = 1; i < tree.size(); ++i) nodes.names.push_back(tree[i].name);
  const NameMatch match = match_names(names, nodes, NameKind::kSpecimens);
  if (!match.problem.empty()) throw InputError(match.problem);
  if (const std::vector<int> lonely = match.unmatched(); !lonely.empty()) fail_without_node(lonely, names, nodes);
  if (!match.note.empty()) notes.push_back(match.note);
  std::vector<const Landmarks*> of_node(tree.size(), nullptr);
  for (std::size_t s = 0; s < shapes.size(); ++s) of_node[index_of(match.partners[s] + 1)] = &shapes[s];
  const std::vector<bool> leaves = leaves_of(tree);
  for (std::size_t i = 1; i < tree.size(); ++i)
    if (leaves[i] && of_node[i] == nullptr)
      throw InputError(fmt::format("no shape is given for the leaf {}", words_for(tree, i)));
  return of_node;
}

// Without momenta λ has no effect, nor has the kernel where noise does not make any.
std::vector<std::string> sampled_names(const std::vector<std::string>& asked, const PosteriorProblem& problem,
                                       bool kernel) {
  const auto has_effect = [&](const std::string& name) { return name != "lambda" && (name != "alpha" || kernel); };
  std::vector<std::string> names;
  for (const std::string& name : asked) {
    if (name == "all") {
      const std::vector<std::string> every = every_parameter(problem);
      std::copy_if(every.begin(), every.end(), std::back_inserter(names), has_effect);
      continue;
    }
    const std::string plain = name.substr(0, name.find('='));
    if (!has_effect(plain))
      throw InputError(fmt::format("{} has no effect on a tree, whose root has no momenta", quoted_line(plain)));
    names.push_back(name);
  }
  return names;
}

// Of the paths from the root to each of two nodes, what both share.
double shared_depth(const std::vector<TreeNode>& tree, const std::vector<double>& depths, std::size_t a,
                    std::size_t b) {
  while (a != b) {
    std::size_t& later = a > b ? a : b;  // parents come before their children
    later = index_of(tree[later].parent);
  }
  return depths[a];
}

}  // namespace

Landmarks brownian_root(const std::vector<TreeNode>& tree, const std::vector<Landmarks>& shapes) {
  if (tree.size() < 2) throw InputError("the tree has no branch");
  const std::vector<double> depths = depths_of(tree);
  std::vector<std::string> notes;
  const std::vector<const Landmarks*> of_node = shapes_by_node(tree, shapes, notes);
  std::vector<std::size_t> known;
  for (std::size_t i = 1; i < tree.size(); ++i)
    if (of_node[i] != nullptr) known.push_back(i);
  const auto count = std::ssize(known);
  Eigen::MatrixXd covariance(count, count);
  for (Eigen::Index i = 0; i < count; ++i)
    for (Eigen::Index j = 0; j < count; ++j) covariance(i, j) = shared_depth(tree, depths, known[i], known[j]);
  Landmarks root = *of_node[known.front()];
  for (const std::size_t node : known)
    if (of_node[node]->points.rows() != root.points.rows() || of_node[node]->points.cols() != root.points.cols())
      throw InputError(fmt::format("{} and {} have different numbers of landmarks or coordinates",
                                   words_for(tree, known.front()), words_for(tree, node)));
  for (Eigen::Index c = 0; c < root.points.size(); ++c) {
    std::vector<Eigen::Index> observed;
    for (Eigen::Index i = 0; i < count; ++i)
      if (std::isfinite(of_node[known[i]]->points.data()[c])) observed.push_back(i);
    if (observed.empty())
      throw InputError(fmt::format("landmark {} is missing in all shapes of the tree; leave it out",
                                   root.describe(static_cast<int>(c / root.points.rows()))));
    Eigen::VectorXd values(std::ssize(observed));
    for (Eigen::Index i = 0; i < values.size(); ++i) values[i] = of_node[known[observed[i]]]->points.data()[c];
    const Eigen::VectorXd weights = covariance(observed, observed).ldlt().solve(Eigen::VectorXd::Ones(values.size()));
    root.points.data()[c] = weights.dot(values) / weights.sum();
  }
  root.name = tree.front().name.empty() ? "root" : tree.front().name;
  root.source = "the root";
  root.image.clear();
  root.curves.clear();
  root.outlines.clear();
  root.absent.clear();
  return root;
}

PosteriorProblem make_tree_problem(const Landmarks& source, const std::vector<TreeNode>& tree,
                                   const std::vector<Landmarks>& shapes, matching::RegistrationOptions options,
                                   const std::vector<std::string>& parameters) {
  if (tree.size() < 2) throw InputError("the tree has no branch");
  const std::vector<double> depths = depths_of(tree);
  std::vector<std::string> notes;
  const std::vector<const Landmarks*> of_node = shapes_by_node(tree, shapes, notes);
  std::vector<Landmarks> observed;
  for (const Landmarks* shape : of_node)
    if (shape != nullptr) observed.push_back(*shape);
  const bool as_given = !options.align && source.dimension() > 1;
  if (!options.align) options.align = AlignmentKind::kNone;
  if (options.kernel.spec() == "auto") options.kernel = "matern32:alpha=auto";  // to which no shape is matched
  const double time = options.grid.time / *std::max_element(depths.begin(), depths.end());
  const double steps = options.grid.steps / options.grid.time;
  if (options.integrator == "auto") options.integrator = "heun";
  PosteriorProblem problem = make_specimens(source, observed, std::move(options)).problem;
  problem.notes.insert(problem.notes.begin(), notes.begin(), notes.end());
  const NoiseTraits traits = problem.specimens.front().system.noise->traits();
  if (problem.specimens.front().system.noise->channels(source.dimension(), source.count()) == 0)
    throw InputError("a tree needs noise: nothing else moves the shapes along it");
  std::size_t next = 0;
  for (std::size_t i = 1; i < tree.size(); ++i) {
    const double of_branch = time * tree[i].length;
    Branch& branch = problem.tree.emplace_back();
    branch.name = tree[i].name;
    branch.parent = tree[i].parent - 1;
    branch.grid = {of_branch, std::max(1, static_cast<int>(std::lround(of_branch * steps)))};
    if (of_node[i] != nullptr) branch.data = problem.specimens[next++].data;
  }
  problem.specimens.erase(problem.specimens.begin() + 1, problem.specimens.end());
  problem.sources.erase(problem.sources.begin() + 1, problem.sources.end());
  add_priors(problem, sampled_names(parameters, problem, !traits.linear));
  if (const double placed = as_given ? part_of_pose(source.points, observed) : 0; placed > kMostlyPose)
    problem.notes.push_back(
        fmt::format("{:.0f} % of the squared distances from the root are position, orientation and size of the shapes, "
                    "and count as evolution; `align = similarity` removes them",
                    100 * placed));
  return problem;
}

}  // namespace pulson::inference
