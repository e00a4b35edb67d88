// `pulson ensemble --sweep`: the probability of crossing over a number of the noise or the kernel.

#include "sweep_job.hpp"

#include <functional>

#include <fmt/format.h>

#include "records/ensemble_facts.hpp"
#include "shell/facts.hpp"
#include "shell/path_options.hpp"
#include "shell/probability_text.hpp"
#include "shell/report_parts.hpp"
#include "shell/run_results.hpp"
#include "shell/units.hpp"
#include "shell/verbs.hpp"

namespace pulson {
namespace {

using Json = nlohmann::ordered_json;

const std::vector<std::string> kSweepFiles = {"sweep.json", "sweep.csv", "report.html"};
const std::vector<std::string> kSweepPictures = {"sweep"};

records::UnitRun identity_of(const SweepJob& job) {
  records::UnitRun run;
  run.verb = "ensemble";
  run.settings = job.settings;
  run.shapes = {job.base.shape};
  run.units = 1;
  return run;
}

std::vector<std::string> sweep_warnings(const std::vector<records::SweepPoint>& points) {
  std::int64_t lost = 0, all = 0, most = 0;
  double at = 0;
  for (const records::SweepPoint& point : points) {
    const ensemble::EnsembleSums& sums = point.run.sums;
    const std::int64_t lost_here = sums.paths.no_root + sums.paths.momentum_bound;
    if (lost_here > most) at = point.value;
    most = std::max(most, lost_here);
    lost += lost_here;
    all += sums.samples;
  }
  if (lost == 0) return {};
  return {
      fmt::format("{} of {} paths are not clean, most of them at {:g}; probabilities are over the clean paths. A "
                  "smaller --dt may help",
                  lost, all, at)};
}

SweptParameter parameter_of(const SweepJob& job) { return {job.sweep.parameter, job.base.system, job.base.shape}; }

charts::Chart sweep_chart(const SweepJob& job, const std::vector<records::SweepPoint>& points) {
  const records::EnsembleRun& base = job.base;
  const SweptParameter parameter = parameter_of(job);
  charts::Series series = probability_series(points, "");
  series.style = charts::SeriesStyle::kLineAndPoints;
  for (std::size_t i = 0; i < series.y.size(); ++i) {
    series.low.push_back(series.y[i] - series.error[i]);
    series.high.push_back(series.y[i] + series.error[i]);
  }
  series.error.clear();
  charts::ChartPanel panel;
  panel.heading = fmt::format("Probability that the order has changed at t = {:.4g}", base.options.grid.time);
  panel.x_label = job.sweep.parameter;
  panel.y_range = {0, 1};
  panel.reference_lines = {{1, ""}, {0.5, "½"}};
  panel.series.push_back(std::move(series));
  return {"The probability of crossing over " + job.sweep.parameter,
          fmt::format("{}  ·  {}  ·  {} paths a value, band: two standard errors  ·  {}, dt = {:.3g}  ·  seed {}",
                      parameter.noise(), parameter.kernel(), base.options.samples, base.integrator,
                      base.options.grid.dt(), base.options.seed),
          {{std::move(panel)}}};
}

std::string crossing_text(const records::SweepPoint& point) {
  return probability_text(point.run.sums.crossing_probability(), point.run.sums.paths.clean);
}

html::ReportTable sweep_table(const SweepJob& job, const std::vector<records::SweepPoint>& points) {
  std::vector<std::reference_wrapper<const records::EnsembleRun>> runs;
  for (const records::SweepPoint& point : points) runs.emplace_back(point.run);
  html::ReportTable table = report_table(
      chosen(records::ensemble_facts(), {"paths.clean", "paths.no_root", "paths.momentum_bound"}), runs, "");
  table.header.insert(table.header.begin(), {job.sweep.parameter, "probability of crossing"});
  for (std::size_t i = 0; i < points.size(); ++i)
    table.rows[i].insert(table.rows[i].begin(), {{fmt::format("{:g}", points[i].value)}, {crossing_text(points[i])}});
  return table;
}

html::ReportTable sweep_settings(const SweepJob& job) {
  const SweptParameter parameter = parameter_of(job);
  html::ReportTable table =
      report_facts(chosen(records::ensemble_facts(), {"integrator", "time", "steps", "seed"}), job.base, "setting");
  table.rows.insert(table.rows.begin(), {{{"start"}, {start_text(job.base.shape)}},
                                         {{"kernel"}, {parameter.kernel()}},
                                         {{"noise"}, {parameter.noise()}}});
  return table;
}

html::HtmlReport sweep_report(const SweepJob& job, const std::vector<records::SweepPoint>& points,
                              const std::filesystem::path& picture) {
  html::HtmlReport report =
      new_report(fmt::format("Crossing over {}, of {}", job.sweep.parameter, start_name(job.base.shape)),
                 fmt::format("{} sample paths for each of {} values, with the same random numbers.",
                             job.base.options.samples, points.size()),
                 sweep_warnings(points), job.base.notes);
  add_still(report, "The probability of crossing", picture);
  report.sections.push_back({"Numbers", {sweep_table(job, points), sweep_settings(job)}});
  return report;
}

void print_sweep(const SweepJob& job, const std::vector<records::SweepPoint>& points) {
  const records::EnsembleRun& base = job.base;
  const SweptParameter parameter = parameter_of(job);
  print_text("{} values of {}, {} paths each to t = {:.4g}: {} steps of {:.4g}, seed {}{}\n", points.size(),
             job.sweep.parameter, base.options.samples, base.options.grid.time, base.options.grid.steps,
             base.options.grid.dt(), base.options.seed, base.options.antithetic ? ", antithetic" : "");
  print_text("model      {}, noise {}, integrator {}\n", parameter.kernel(), parameter.noise(), base.integrator);
  for (const records::SweepPoint& point : points)
    print_text("{:<10} {}\n", fmt::format("{:g}", point.value), crossing_text(point));
}

int write_sweep(const SweepJob& job, const std::vector<records::SweepPoint>& points, const std::string& fingerprint) {
  RunResults results(job.output);
  results.add("sweep.csv", records::sweep_csv(points));
  results.commit("sweep.json", records::sweep_json(job.sweep.parameter, points), Json{{"run", fingerprint}});
  results.draw("sweep", [&](const draw::PictureFiles& files) { write_chart(sweep_chart(job, points), files); });
  results.add_page([&] { return sweep_report(job, points, results.shown("sweep")); });
  results.finish();
  print_notes(job.base.notes);
  if (job.output.prints()) {
    print_sweep(job, points);
    results.print_written();
  }
  const std::vector<std::string> warnings = sweep_warnings(points);
  for (const std::string& text : warnings) print_warning(text);
  return warnings.empty() ? kDone : kNotConverged;
}

}  // namespace

int run_sweep(const SweepJob& job) {
  if (job.base.start.q.rows() != 1 || job.base.start.q.cols() < 2)
    throw InputError(
        fmt::format("--sweep: the probability of crossing is of two or more landmarks on a line; there {} "
                    "in {}D",
                    job.base.start.q.cols() == 1 ? "is 1" : fmt::format("are {}", job.base.start.q.cols()),
                    job.base.start.q.rows()));
  const SweptParameter parameter = parameter_of(job);
  for (const double value : job.sweep.values) static_cast<void>(parameter.at(value));
  job.output.check(kSweepFiles, kSweepPictures);
  const std::filesystem::path folder = job.output.file("sweep.partial");
  const records::UnitRun identity = identity_of(job);
  const std::string fingerprint = unit_fingerprint(identity);
  if (!saved_before(folder, job.resume) && job.resume && is_done_before(job.output.file("sweep.json"), fingerprint))
    return kDone;
  const SavedEnsembles saved(folder, identity);
  std::vector<records::SweepPoint> points;
  try {
    const Interrupt interrupt;
    Progress progress;
    points = sample_sweep(job.base, job.sweep, saved, "", progress);
  } catch (const Interrupted&) {
    print_warning(
        fmt::format("interrupted: the paths so far are saved in '{}'; continue with --resume", folder.string()));
    return kNotConverged;
  }
  const int code = write_sweep(job, points, fingerprint);
  saved.remove();
  return code;
}

}  // namespace pulson
