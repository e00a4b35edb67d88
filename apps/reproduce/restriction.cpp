// §5.4: parametric noise, and noise in the momenta alone.

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

#include "core/csv_table.hpp"
#include "laboratory.hpp"

namespace pulson {
namespace {

constexpr double kFollowed = 0.01;  // so many may be lost where a claim is tested
constexpr double kNear = 0.05;      // a gap that counts as asymptotically closed
// Paths of noise that lanes do not know, which take 50 ms each: 16 blocks, and in a quick run one.
constexpr std::int64_t kSlowPaths = 16 * ensemble::kBlockPaths, kQuickSlowPaths = ensemble::kBlockPaths;

struct Potential {
  std::string name;     ///< for csv
  std::string formula;  ///< of the paper
  std::string noise;    ///< without its amplitude
  std::vector<double> betas;
  bool of_paper;      ///< else it is pulson's own question
  bool quick_sample;  ///< one path at a time: fewer paths
};

const std::vector<Potential>& potentials() {
  static const std::vector<Potential> kPotentials = {
      {"p-sd", "β(p₁ + p₂)", "p-sd", {0.5, 1, 2, 4, 6.5}, true, false},
      {"trouve-vialard", "β q₂", "trouve-vialard:on=2", {0.1, 0.25, 0.5, 1}, true, false},
      {"potential", "β exp(−(q₁ − q₂)²/γ), γ = 4", "potential:gamma=4", {0.5, 1, 2, 4}, true, false},
      {"p-sd-cos", "Σ β p cos q", "p-sd:fields=cos,wavenumber=1", {0.25, 1}, false, true}};
  return kPotentials;
}

/// Those of the paper, or the noise and the amplitudes that were asked for.
std::vector<Potential> chosen_potentials(const OwnValues& own) {
  std::vector<Potential> chosen = potentials();
  if (!own.noise.empty())
    chosen = {{own.noise.substr(0, own.noise.find(':')), own.noise, own.noise, {0.5, 1, 2, 4}, false, false}};
  for (Potential& potential : chosen) potential.betas = own.betas_or(potential.betas);
  return chosen;
}

struct Run {
  const Potential* potential;
  PaperPair pair;
  double beta;
  ensemble::EnsembleSums sums;

  double near() const {
    std::int64_t count = 0;
    for (std::size_t m = 0; m + 3 < sums.states.size(); m += 4)
      if (std::abs(sums.states[m + 1] - sums.states[m]) < kNear) ++count;
    return static_cast<double>(count) / static_cast<double>(sums.paths.clean);
  }
};

ensemble::EnsembleSums sample(const Laboratory& laboratory, const Potential& potential, const PaperPair& pair) {
  const std::string what = fmt::format("section5.4, {}, {}", pair.noise, pair.kernel.name);
  if (!potential.quick_sample) return laboratory.sample(pair, what, {}, ensemble::KeepStates::kFinal);
  ensemble::EnsembleOptions options;
  options.grid = laboratory.options().grid;
  options.seed = laboratory.options().seed;
  options.samples = laboratory.options().quick ? kQuickSlowPaths : kSlowPaths;
  options.keep = ensemble::KeepStates::kFinal;
  return laboratory.finish(paper_system(pair), "variational-paper", paper_start(pair.p1), options, what);
}

std::vector<html::ReportCell> row_of(const Run& run) {
  const ensemble::PathCounts& paths = run.sums.paths;
  return {{run.potential->formula},
          {run.pair.kernel.name},
          {fmt::format("{:g}", run.beta)},
          {fmt::format("{}", run.sums.samples)},
          {fmt::format("{}", run.sums.crossing.at_end)},
          {fmt::format("{}", run.sums.crossing.ever)},
          {fmt::format("{}", paths.clean)},
          {fmt::format("{}", paths.no_root)},
          {fmt::format("{}", paths.momentum_bound)},
          {fmt::format("{:.1f} %", 100 * run.near())}};
}

std::string csv_of(const std::vector<Run>& runs) {
  text::CsvTable table{"potential", "kernel", "beta",    "samples",        "crossed",
                       "ever",      "clean",  "no_root", "momentum_bound", "near"};
  for (const Run& run : runs) {
    const ensemble::PathCounts& paths = run.sums.paths;
    table.words({run.potential->name, run.pair.kernel.name});
    table.numbers(run.beta, run.sums.samples, run.sums.crossing.at_end, run.sums.crossing.ever, paths.clean,
                  paths.no_root, paths.momentum_bound, run.near());
    table.end_row();
  }
  return std::move(table).take();
}

double lost_part(const Run& run) {
  return 1 - static_cast<double>(run.sums.paths.clean) / static_cast<double>(run.sums.samples);
}

/// "No crossing" for one potential and kernel: among the amplitudes at which nearly all paths could be followed, and
/// among the others, of which it cannot be known.
void add_claims(html::ReportClaims& claims, const std::vector<Run>& runs, const Potential& potential,
                const PaperKernel& kernel) {
  for (const bool followed : {true, false}) {
    std::int64_t clean = 0, crossed = 0, ever = 0;
    double most_lost = 0;
    std::string betas;
    for (const Run& run : runs) {
      if (run.potential != &potential || run.pair.kernel.spec != kernel.spec ||
          (lost_part(run) <= kFollowed) != followed)
        continue;
      clean += run.sums.paths.clean;
      crossed += run.sums.crossing.at_end;
      ever += run.sums.crossing.ever;
      most_lost = std::max(most_lost, lost_part(run));
      betas += fmt::format("{}{:g}", betas.empty() ? "" : ", ", run.beta);
    }
    if (betas.empty()) continue;
    const html::Verdict verdict = ever > 0   ? html::Verdict::kDoesNotHold
                                  : followed ? html::Verdict::kHolds
                                             : html::Verdict::kNotTested;
    std::string measured = fmt::format("{} of {} clean paths crossed, {} ever did", crossed, clean, ever);
    if (most_lost > 0)
      measured += fmt::format("; up to {:.3g} % of the paths could not be followed to the end", 100 * most_lost);
    if (!followed) measured += ", so it is not known whether they cross";
    claims.push_back({fmt::format("h = {}: {} do not cross, at β = {}{}.", potential.formula, kernel.particle, betas,
                                  potential.of_paper ? "" : " (of the kind of Lemma 1, but not run in the paper)"),
                      verdict, measured});
  }
}

void add_all_claims(html::ReportSection& section, const std::vector<Potential>& all, const std::vector<Run>& runs) {
  html::ReportClaims claims;
  for (const Potential& potential : all)
    for (const PaperKernel& kernel : paper_kernels()) add_claims(claims, runs, potential, kernel);
  double most_near = 0;
  for (const Run& run : runs)
    if (run.potential->of_paper) most_near = std::max(most_near, run.near());
  claims.push_back(
      {"In many cases the pulsons would asymptotically approach each other, but never pass.",
       most_near > 0.01 ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
       fmt::format("up to {:.0f} % of the clean paths end with a gap below {:g}", 100 * most_near, kNear)});
  section.blocks.emplace_back(std::move(claims));
}

}  // namespace

html::ReportSection section54(const Laboratory& laboratory) {
  const OwnValues& own = laboratory.own();
  const std::vector<Potential> all = chosen_potentials(own);
  std::vector<Run> runs;
  for (const Potential& potential : all)
    for (const PaperKernel& kernel : own.kernels_or(paper_kernels()))
      for (const double beta : potential.betas) {
        const PaperPair pair{kernel, noise_at(potential.noise, beta), 4};
        runs.push_back({&potential, pair, beta, sample(laboratory, potential, pair)});
      }

  html::ReportSection section{"Section 5.4: parametric noise, and noise in the momenta alone", {}};
  section.blocks.emplace_back(html::ReportParagraph{
      "Each step takes the root that is connected with dt = 0, which preserves the order of the landmarks. Where that "
      "branch ends before the step does, the path has no root and is counted as such; a solver that accepts any root "
      "jumps there and reports crossings that the equation does not have. Paths with momenta beyond 1e8 also count as "
      "lost: momenta grow exponentially in head-on encounters, and peakons collide in finite time."});
  laboratory.write_csv("section5.4.csv", csv_of(runs));
  if (own.is_of_paper({}))
    add_all_claims(section, all, runs);
  else
    add_own_results(section, own, {});
  html::ReportTable table{{"potential h", "kernel", "β", "paths", "crossed at the end", "ever", "clean", "no root",
                           "momenta beyond 1e8", fmt::format("gap below {:g}", kNear)},
                          {},
                          "p̄₁ = 4"};
  for (const Run& run : runs) table.rows.push_back(row_of(run));
  section.blocks.emplace_back(std::move(table));
  return section;
}

}  // namespace pulson
