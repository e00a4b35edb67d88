// Figure 2: mean paths.

#include <cmath>

#include <fmt/format.h>

#include "core/csv_table.hpp"
#include "laboratory.hpp"

namespace pulson {
namespace {

const std::vector<double> kMeanBetas = {1.5, 2.5, 4.5};
constexpr double kMeanMomentum = 4;

struct Means {
  double beta;
  PaperPair pair;
  ensemble::EnsembleSums sums;
};

charts::Series mean_over_time(const Laboratory& laboratory, const Means& means, const std::vector<int>& records,
                              Eigen::Index coordinate) {
  charts::Series series;
  series.name = coordinate % 2 == 0 ? "faster pulson: q₁, p₁" : "slower pulson: q₂, p₂";
  for (std::size_t record = 0; record < records.size(); ++record) {
    const double mean = means.sums.moments[record].mean[coordinate];
    const double deviation = std::sqrt(means.sums.moments[record].variance()[coordinate]);
    series.x.push_back(laboratory.options().grid.at(records[record]));
    series.y.push_back(mean);
    series.low.push_back(mean - deviation);
    series.high.push_back(mean + deviation);
  }
  return series;
}

charts::Series deterministic(const Laboratory& laboratory, const ensemble::SamplePath& path, int landmark,
                             bool momentum) {
  charts::Series series;
  series.name = "without noise";
  series.colour = charts::Series::kInk;
  series.dashed = true;
  for (std::size_t k = 0; k < path.path.states.size(); k += 10) {
    series.x.push_back(laboratory.options().grid.at(static_cast<int>(k)));
    series.y.push_back((momentum ? path.path.states[k].p : path.path.states[k].q)(landmark));
  }
  return series;
}

charts::Chart chart_of_means(const Laboratory& laboratory, const std::vector<Means>& all,
                             const std::vector<int>& records, const ensemble::SamplePath& without_noise) {
  charts::Chart chart{fmt::format("Mean paths of {}, p̄₁ = 4", all.front().pair.kernel.particle),
                      fmt::format("means of {} paths, shaded: one standard deviation  ·  dt = {:.3g}  ·  seed {}",
                                  all.front().sums.samples, laboratory.options().grid.dt(), laboratory.options().seed),
                      {{}, {}},
                      true};
  for (const Means& means : all)
    for (const bool momentum : {false, true}) {
      charts::ChartPanel panel;
      panel.heading = fmt::format("{} over time t, β = {:g}", momentum ? "Momenta p" : "Positions q", means.beta);
      for (int a = 0; a < 2; ++a) panel.series.push_back(deterministic(laboratory, without_noise, a, momentum));
      for (int a = 0; a < 2; ++a)
        panel.series.push_back(mean_over_time(laboratory, means, records, (momentum ? 2 : 0) + a));
      if (momentum) show_early_times(panel, laboratory.options().grid);
      chart.rows[momentum ? 1 : 0].push_back(std::move(panel));
    }
  return chart;
}

std::string csv_of_means(const Laboratory& laboratory, const std::vector<Means>& all, const std::vector<int>& records) {
  text::CsvTable table{"beta",    "time",     "mean_q1",  "mean_q2",  "mean_p1",
                       "mean_p2", "error_q1", "error_q2", "error_p1", "error_p2"};
  for (const Means& means : all)
    for (std::size_t record = 0; record < records.size(); ++record) {
      table.numbers(means.beta, laboratory.options().grid.at(records[record]));
      table.numbers(means.sums.moments[record].mean).numbers(means.sums.mean_error(record)).end_row();
    }
  return std::move(table).take();
}

/// E p₁ at the end.
Estimate final_momentum(const ensemble::EnsembleSums& sums) {
  const std::size_t last = sums.moments.size() - 1;
  return {sums.moments[last].mean[2], sums.mean_error(last)[2]};
}

void add_claims(html::ReportSection& section, const Laboratory& laboratory, const std::vector<Means>& all,
                const ensemble::SamplePath& without_noise) {
  const double exchanged = without_noise.path.final().p(0);
  const Estimate small = final_momentum(
      laboratory.sample({all.front().pair.kernel, noise_at("ch-sd:on=2", 0.5), kMeanMomentum}, "figure2, beta = 0.5"));
  html::ReportClaims claims;
  const auto part = [&](double p1) { return 100 * (kMeanMomentum - p1) / (kMeanMomentum - exchanged); };
  claims.push_back(
      {"For small noise the mean solution resembles the deterministic one.",
       part(small.value) > 90 ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
       fmt::format("without noise p₁ falls from 4 to {:.4g}: the momenta are exchanged. In the mean, {:.1f} % of that "
                   "exchange takes place at β = 0.5 (p₁ = {}) and {:.0f} % at β = 1.5",
                   exchanged, part(small.value), text_of(small), part(final_momentum(all[0].sums).value))});
  const Estimate low = final_momentum(all[0].sums), middle = final_momentum(all[1].sums),
                 high = final_momentum(all[2].sums);
  const bool rises = standard_errors_apart(middle, low) > 4 && standard_errors_apart(high, middle) > 4;
  claims.push_back(
      {"As β is increased, the mean solution represents two pulsons passing through each other with "
       "increasingly less interaction.",
       rises ? html::Verdict::kHolds : html::Verdict::kDoesNotHold,
       fmt::format("mean p₁ at the end: {}, {}, {} for β = 1.5, 2.5, 4.5; without interaction it stays 4", text_of(low),
                   text_of(middle), text_of(high))});
  section.blocks.emplace_back(std::move(claims));
}

}  // namespace

html::ReportSection figure2(const Laboratory& laboratory) {
  const OwnValues& own = laboratory.own();
  const PaperKernel kernel = own.kernels_or({paper_kernels().front()}).front();
  const std::string noise = own.noise_or("ch-sd:on=2");
  const std::vector<int> records = ensemble::spread_steps(laboratory.options().grid, 501);
  std::vector<Means> all;
  for (const double beta : own.betas_or(kMeanBetas)) {
    const PaperPair pair{kernel, noise_at(noise, beta), kMeanMomentum};
    all.push_back({beta, pair, laboratory.sample(pair, fmt::format("figure2, beta = {}", beta), records)});
  }
  const ensemble::SamplePath without_noise = laboratory.paths({kernel, "none", kMeanMomentum}, 1).front();

  html::ReportSection section{"Figure 2: mean paths", {}};
  laboratory.write_csv("figure2.csv", csv_of_means(laboratory, all, records));
  std::string betas;
  for (const Means& means : all) betas += fmt::format("{}{:g}", betas.empty() ? "" : ", ", means.beta);
  laboratory.add_chart(section, "figure2", chart_of_means(laboratory, all, records, without_noise),
                       fmt::format("Mean paths for β = {}, with one standard deviation; dashed: without noise", betas));
  if (own.is_of_paper(kMeanBetas)) {
    add_claims(section, laboratory, all, without_noise);
  } else {
    std::vector<std::pair<PaperPair, ensemble::EnsembleSums>> ensembles;
    for (const Means& means : all) ensembles.emplace_back(means.pair, means.sums);
    add_own_results(section, own, ensembles);
  }
  return section;
}

}  // namespace pulson
