// Strong and weak orders of convergence of every integrator that takes noise, as Markdown; see docs/orders.md.

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <exception>
#include <string>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>

#include "convergence.hpp"
#include "pulson/core/parallel.hpp"

namespace {

using namespace pulson::convergence;

struct Measured {
  Case setting;
  Measurement measurement;
};

// With as many digits as the standard error is worth.
std::string text(const Estimate& e) {
  const int digits = e.error > 0 ? std::max(0, 1 - static_cast<int>(std::floor(std::log10(e.error)))) : 4;
  return fmt::format("{:.{}f} ± {:.{}f}", e.value, digits, e.error, digits);
}

std::string text(const Case& setting) { return fmt::format("`{}`, {}D", setting.noise, setting.start.q.rows()); }

std::string text(const Row& row) {
  return fmt::format("`{}`{}", row.integrator, row.limit == Limit::kPaper ? " → its own" : "");
}

// A slope, and what is claimed of it: `= 1` agrees, `≠ 1` does not, `? 1` is too close to call.
std::string text(const Measured& m, const Row& row, Quantity quantity) {
  const Order& order = row.orders[quantity];
  const Claim claim = claim_of(m.setting, row, quantity);
  const bool stall = claim.kind == Claim::Kind::kStalls;
  const Verdict verdict = stall ? stalls(m.setting, m.measurement, quantity) : compare(order, claim, quantity);
  const char* const sign = verdict == Verdict::kAgrees ? "=" : verdict == Verdict::kDiffers ? "≠" : "?";
  std::string cell = order.points == 0 ? "hidden" : text(order.slope);
  if (order.points > 0 && order.points < static_cast<int>(row.means[quantity].size()))
    cell += fmt::format(", {} points", order.points);
  if (stall) return cell + fmt::format(" ({} stalls)", sign);
  const char* const relation = claim.kind == Claim::Kind::kIsAtLeast ? "≥" : "=";
  return cell + (order.points == 0
                     ? fmt::format(" (claimed {} {:g})", relation, claim.order)
                     : fmt::format(" ({} {:g})", verdict == Verdict::kAgrees ? relation : sign, claim.order));
}

void print_head(const std::vector<std::string>& columns) {
  std::string rule = "|";
  fmt::print("|");
  for (const std::string& column : columns) {
    fmt::print(" {} |", column);
    rule += "---|";
  }
  fmt::print("\n{}\n", rule);
}

// One line for each row of each case; `cells` gives what follows the names.
template <class Cells>
void print_table(const std::string& title, std::vector<std::string> columns, const std::vector<Measured>& all,
                 const Cells& cells) {
  fmt::print("### {}\n", title);
  columns.insert(columns.begin(), {"noise", "integrator"});
  print_head(columns);
  for (const Measured& m : all) {
    bool first = true;
    for (const Row& row : m.measurement.rows) {
      fmt::print("| {} | {} | {} |\n", first ? text(m.setting) : "", text(row), fmt::join(cells(m, row), " | "));
      first = false;
    }
  }
  fmt::print("\n");
}

std::vector<std::string> step_columns(const Plan& plan) {
  std::vector<std::string> columns;
  for (const int steps : plan.steps) columns.push_back(fmt::format("Δt = {:.4g}", plan.time / steps));
  return columns;
}

std::vector<std::string> orders(const Measured& m, const Row& row, std::initializer_list<Quantity> quantities) {
  std::vector<std::string> cells;
  for (const Quantity quantity : quantities)
    cells.push_back(quantity == kCompleted && !lags(row.integrator) ? "" : text(m, row, quantity));
  return cells;
}

std::vector<std::string> errors(const Row& row, Quantity quantity) {
  std::vector<std::string> cells;
  for (const Estimate& mean : row.means[quantity]) cells.push_back(text(mean));
  return cells;
}

void print_strong(const std::vector<Measured>& all, const Plan& plan) {
  print_table("Strong orders", {"q", "(q, p̂)", "completed"}, all, [](const Measured& m, const Row& row) {
    return orders(m, row, {kPosition, kState, kCompleted});
  });
  print_table("Strong errors of q", step_columns(plan), all,
              [](const Measured&, const Row& row) { return errors(row, kPosition); });
  print_table("Strong errors of (q, p̂)", step_columns(plan), all,
              [](const Measured&, const Row& row) { return errors(row, kState); });
}

void print_weak(const std::vector<Measured>& all, const Plan& plan) {
  const std::vector<std::string> columns = {"q₂", "q₂²", "p₁", "p₁²"};
  print_table("Weak orders", columns, all, [](const Measured& m, const Row& row) {
    return orders(m, row, {kMeanQ, kSquareQ, kMeanP, kSquareP});
  });
  print_table(fmt::format("Weak errors at Δt = {:.4g}", plan.time / plan.steps.front()), columns, all,
              [](const Measured&, const Row& row) {
                std::vector<std::string> cells;
                for (const Quantity quantity : {kMeanQ, kSquareQ, kMeanP, kSquareP})
                  cells.push_back(errors(row, quantity).front());
                return cells;
              });
}

// The smallest strong error that was measured against a limit it converges to.
double smallest_error(const Measurement& measurement) {
  double smallest = INFINITY;
  for (const Row& row : measurement.rows)
    if (!row.means[kState].empty()) smallest = std::min(smallest, row.means[kState].back().value);
  return smallest;
}

void print_references(const std::vector<Measured>& all) {
  fmt::print("### References\n");
  print_head({"noise", "references apart", "smallest error", "limits apart", "paths without reference"});
  for (const auto& [setting, m] : all)
    fmt::print("| {} | {} | {:.2g} | {} | {} |\n", text(setting), text(m.references_apart), smallest_error(m),
               m.limits_apart[kState].value > 0 ? text(m.limits_apart[kState]) : "the same", m.reference_failed);
  fmt::print("\n");
}

// Rows against the paper's limit are the same paths again.
bool is_lossy(const Row& row) {
  return row.limit == Limit::kStratonovich && std::ranges::any_of(row.failed, [](int n) { return n > 0; });
}

void print_failures(const std::vector<Measured>& all, const Plan& plan) {
  fmt::print("### Paths left out because a step had no solution\n");
  const bool any =
      std::ranges::any_of(all, [](const Measured& m) { return std::ranges::any_of(m.measurement.rows, is_lossy); });
  if (!any) return fmt::print("None of {}.\n", plan.paths);
  std::vector<std::string> columns = step_columns(plan);
  columns.insert(columns.begin(), {"noise", "integrator"});
  print_head(columns);
  for (const auto& [setting, m] : all)
    for (const Row& row : m.rows)
      if (is_lossy(row)) fmt::print("| {} | {} | {} |\n", text(setting), text(row), fmt::join(row.failed, " | "));
}

std::vector<Measured> measure_all(const Plan& plan, const std::string& only) {
  std::vector<Measured> all;
  for (const Case& setting : cases()) {
    if (setting.noise.find(only) == std::string::npos) continue;
    const auto start = std::chrono::steady_clock::now();
    all.push_back({setting, measure(setting, plan)});
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    fmt::print(stderr, "{}: {:.0f} s\n", text(setting), seconds.count());
  }
  return all;
}

void print(const std::vector<Measured>& all, const Plan& plan) {
  fmt::print("{} paths, seed {}, T = {}, reference of {} steps.\n\n", plan.paths, plan.seed, plan.time,
             plan.reference_steps);
  print_strong(all, plan);
  print_weak(all, plan);
  print_references(all);
  print_failures(all, plan);
}

int run(int argc, char** argv) {
  CLI::App program("Strong and weak orders of convergence, as Markdown");
  Plan plan;
  int threads = 0;
  std::string only;
  program.add_option("--paths", plan.paths, "Brownian paths")->capture_default_str()->check(CLI::Range(2, 1 << 30));
  program.add_option("--seed", plan.seed, "of the paths")->capture_default_str();
  program.add_option("--threads", threads, "0: one per core; results do not depend on it")->capture_default_str();
  program.add_option("--steps", plan.steps, "of the grids, coarsest first")->capture_default_str()->delimiter(',');
  program.add_option("--reference", plan.reference_steps, "steps of the reference, a multiple of each and of 2")
      ->capture_default_str();
  program
      .add_option("--integrators", plan.integrators, "rows of `pulson info integrators`; all that take noise if empty")
      ->delimiter(',');
  program.add_option("--only", only, "cases whose noise has this in its specification");
  CLI11_PARSE(program, argc, argv);
  pulson::set_thread_count(threads);

  print(measure_all(plan, only), plan);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    return run(argc, argv);
  } catch (const std::exception& error) {
    std::fputs((std::string(error.what()) + "\n").c_str(), stderr);
    return 2;
  }
}
