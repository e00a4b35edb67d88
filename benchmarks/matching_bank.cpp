// Registers a bank of matching problems, each in a process of its own, and prints a row of a table in Markdown for
// each: what it cost, how that compares with the lowest J known, and what an accurate integrator makes of the result.
// See docs/benchmarks.md.
//
//   matching_bank [--problems FOLDER] [--data FOLDER] [--only REGEX] [--large] [--limit SECONDS] [--update]

#include <algorithm>
#include <array>
#include <cmath>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <exception>
#include <fstream>
#include <limits>
#include <map>
#include <optional>
#include <regex>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include <CLI/CLI.hpp>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include "accurate_shot.hpp"
#include "core/atomic_file.hpp"
#include "matching_problems.hpp"
#include "pulson/core/parallel.hpp"

namespace {

using namespace pulson;

// The bounds that the summary counts by.
constexpr double kAboveBest = 1e-3;      // of J
constexpr double kEndTolerance = 1e-4;   // diameters
constexpr double kCostTolerance = 1e-2;  // of J

struct Settings {
  BankFolders folders;
  std::string only;
  bool large = false;
  int limit = 60;  // CPU seconds
  int jobs = 1;
  int threads = 1;
  std::string noise_mode;
  std::string integrator = "auto";
  std::string best;
  bool update = false;
};

// ---- one problem in a process of its own

enum class Status { kNothing, kNotAvailable, kRefused, kRegistered, kChecked };

// What a child process sends through its pipe: once after the registration, and again with the shot.
struct Outcome {
  Status status = Status::kNothing;
  int count = 0, dimension = 0, iterations = 0, evaluations = 0;
  bool converged = false;
  matching::MatchingCost cost;
  double rms_in_sigma = 0, seconds = 0, amplification = 0;
  AccurateShot shot;
  std::array<char, 200> remark{};  // ends with 0
};

double cpu_seconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + 1e-9 * static_cast<double>(time.tv_nsec);
}

// The process is ended after `seconds` more of CPU time, or ten times as many by the clock, in which it may wait.
void allow(int seconds) {
  rlimit limit{};
  getrlimit(RLIMIT_CPU, &limit);
  limit.rlim_cur = static_cast<rlim_t>(std::ceil(cpu_seconds()) + seconds);
  setrlimit(RLIMIT_CPU, &limit);
  alarm(static_cast<unsigned>(10 * seconds));
}

void send(int pipe, const Outcome& outcome) {
  if (write(pipe, &outcome, sizeof outcome) != sizeof outcome) _exit(1);
}

void send_remark(int pipe, Status status, const char* remark) {
  Outcome outcome;
  outcome.status = status;
  std::strncpy(outcome.remark.data(), remark, outcome.remark.size() - 1);
  send(pipe, outcome);
}

std::optional<matching::MatchingMode> mode_of(const BankProblem& problem) {
  if (problem.mode.empty()) return std::nullopt;
  try {
    return matching::parse_mode(problem.mode);
  } catch (const InputError&) {
    throw NotAvailable("mode not available");
  }
}

void solve(const BankProblem& problem, const Settings& settings, int pipe) {
  set_thread_count(settings.threads);
  allow(settings.limit);
  matching::RegistrationOptions options = problem.options;
  options.mode = mode_of(problem);
  options.integrator = settings.integrator;
  const MatchingPair shapes = problem.shapes();
  const double start = cpu_seconds();
  const matching::Registration registration = register_shapes(shapes.source, shapes.target, options);
  Outcome outcome;
  outcome.seconds = cpu_seconds() - start;
  outcome.status = Status::kRegistered;
  outcome.count = registration.source.count();
  outcome.dimension = registration.source.dimension();
  outcome.iterations = registration.iterations;
  outcome.evaluations = registration.evaluations;
  outcome.converged = registration.converged;
  outcome.cost = registration.cost;
  outcome.amplification = registration.amplification.value_or(std::numeric_limits<double>::quiet_NaN());
  outcome.rms_in_sigma = registration.rms() / registration.sigma;
  send(pipe, outcome);
  allow(std::max(settings.limit, 600));
  outcome.shot = shoot_accurately(registration);
  outcome.status = Status::kChecked;
  send(pipe, outcome);
}

struct Child {
  pid_t process = 0;
  int pipe = 0;  // to read from
};

Child start(const BankProblem& problem, const Settings& settings) {
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw std::runtime_error("no pipe");
  std::fflush(stdout);
  const pid_t process = fork();
  if (process < 0) throw std::runtime_error("no process");
  if (process > 0) {
    close(ends[1]);
    return {process, ends[0]};
  }
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);
  try {
    solve(problem, settings, ends[1]);
  } catch (const NotAvailable& error) {
    send_remark(ends[1], Status::kNotAvailable, error.what());
  } catch (const std::exception& error) {
    send_remark(ends[1], Status::kRefused, error.what());
  }
  _exit(0);
}

std::string end_of_process(int status, int limit) {
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGXCPU) return fmt::format("over {} s", limit);
  if (WIFSIGNALED(status) && WTERMSIG(status) == SIGALRM) return fmt::format("stalled for {} s", 10 * limit);
  return WIFSIGNALED(status) ? fmt::format("ended by signal {}", WTERMSIG(status)) : "no result";
}

struct Result {
  Outcome outcome;
  std::string remark;
};

Result finish(const Child& child, int limit) {
  Result result;
  for (Outcome next; read(child.pipe, &next, sizeof next) == sizeof next;) result.outcome = next;
  close(child.pipe);
  int status = 0;
  waitpid(child.process, &status, 0);
  result.remark = result.outcome.remark.data();
  if (result.outcome.status == Status::kNothing) result.remark = end_of_process(status, limit);
  if (result.outcome.status == Status::kRegistered) result.remark = "not checked";
  return result;
}

// ---- the lowest J known

struct Best {
  double cost = 0;
  std::string from;
};

// A file of lines `name J from`, and comments.
class BestTable {
 public:
  explicit BestTable(const std::string& path) {
    std::ifstream file(path);
    if (!file) throw InputError(path + ": cannot be read");
    for (std::string line; std::getline(file, line);) {
      if (line.starts_with('#')) {
        comments_ += line + '\n';
        continue;
      }
      std::istringstream words(line);
      std::string name;
      Best best;
      if (!(words >> name)) continue;
      if (!(words >> best.cost)) throw InputError(fmt::format("{}: '{}' has no J", path, name));
      std::getline(words >> std::ws, best.from);
      names_.push_back(name);
      rows_[name] = best;
    }
  }

  const Best* find(const std::string& name) const {
    const auto row = rows_.find(name);
    return row == rows_.end() ? nullptr : &row->second;
  }

  // Only if it is lower. @param cost in the digits that the file has
  void lower(const std::string& name, const std::string& cost, const std::string& from) {
    const Best* const known = find(name);
    if (known && known->cost <= std::stod(cost)) return;
    if (!known) names_.push_back(name);
    rows_[name] = {std::stod(cost), from};
  }

  void write(const std::string& path) const {
    std::string text = comments_;
    for (const std::string& name : names_) {
      const Best& row = rows_.at(name);
      text += fmt::format("{} {:.6g} {}\n", name, row.cost, row.from);
    }
    write_file_atomically(path, text);
  }

 private:
  std::string comments_;
  std::vector<std::string> names_;  // in the order of the file
  std::map<std::string, Best> rows_;
};

// ---- the table

bool has_registration(const Outcome& outcome) { return outcome.status >= Status::kRegistered; }

bool is_above(const Outcome& outcome, const Best* best) {
  return best && has_registration(outcome) && !(outcome.cost.total() <= (1 + kAboveBest) * best->cost);
}

bool cost_agrees(const Outcome& outcome) {
  constexpr double kNothing = 1e-6;  // identical shapes
  const double cost = outcome.cost.total();
  return std::abs(outcome.shot.cost - cost) <= kCostTolerance * cost + kNothing;
}

bool check_is_off(const Outcome& outcome) {
  return outcome.status == Status::kChecked && !(outcome.shot.end_error <= kEndTolerance && cost_agrees(outcome));
}

void print_head() {
  fmt::print(
      "| problem | mode | N | d | noise | K | J | best | energy | action | data | rms/σ | iterations | "
      "evaluations | CPU s | converged | check: end/D | check: J | step error/D | amplification | remarks |\n|");
  for (int column = 0; column < 21; ++column) fmt::print("---|");
  fmt::print("\n");
}

std::string remarks(const BankProblem& problem, const Result& result, const Best* best) {
  std::vector<std::string> all;
  if (!result.remark.empty()) all.push_back(result.remark);
  if (problem.closed_form) all.push_back(fmt::format("closed form {:.4f}", *problem.closed_form));
  if (is_above(result.outcome, best))
    all.push_back(fmt::format("{:.2g} % above the best", 100 * (result.outcome.cost.total() / best->cost - 1)));
  if (check_is_off(result.outcome)) all.push_back("check is off");
  return fmt::format("{}", fmt::join(all, "; "));
}

std::string number(const char* format, double value) {
  return std::isnan(value) ? "–" : fmt::format(fmt::runtime(format), value);
}

void print_row(const BankProblem& problem, const Result& result, const Best* best) {
  const Outcome& of = result.outcome;
  const std::string known = best ? fmt::format("{:.5g}", best->cost) : "";
  fmt::print("| {} | {} ", problem.name, problem.mode.empty() ? "default" : problem.mode);
  if (has_registration(of)) {
    fmt::print("| {} | {} | {} | {} | {:.5g} | {} | {:.4g} | {:.4g} | {:.4g} | {:.3g} | {} | {} | {:.2f} | {} ",
               of.count, of.dimension, problem.options.noise.spec(), problem.options.grid.steps, of.cost.total(), known,
               of.cost.energy, of.cost.action, of.cost.data, of.rms_in_sigma, of.iterations, of.evaluations, of.seconds,
               of.converged ? "yes" : "no");
  } else {
    fmt::print("| | | {} | {} | | {} | | | | | | | | ", problem.options.noise.spec(), problem.options.grid.steps,
               known);
  }
  if (of.status == Status::kChecked)
    fmt::print("| {:.1e} | {:.5g} | {} | {} ", of.shot.end_error, of.shot.cost, number("{:.0e}", of.shot.step_error),
               number("{:.2g}", of.amplification));
  else
    fmt::print("| | | | ");
  fmt::print("| {} |\n", remarks(problem, result, best));
  std::fflush(stdout);
}

struct Summary {
  std::vector<int> iterations;
  int problems = 0, registered = 0, not_available = 0, unconverged = 0, above = 0, compared = 0, off = 0, checked = 0;

  void add(const Outcome& outcome, const Best* best) {
    ++problems;
    if (outcome.status == Status::kNotAvailable) ++not_available;
    if (outcome.status == Status::kChecked) ++checked;
    if (check_is_off(outcome)) ++off;
    if (!has_registration(outcome)) return;
    ++registered;
    iterations.push_back(outcome.iterations);
    if (!outcome.converged) ++unconverged;
    if (best) ++compared;
    if (is_above(outcome, best)) ++above;
  }

  void print() {
    std::sort(iterations.begin(), iterations.end());
    fmt::print(
        "\n{} problems, {} registered, {} not available, {} without a result. Of those registered {} not "
        "converged; iterations: median {}, at most {}; {} of {} more than {:g} % above the best known; check off "
        "by more than {:g} D or {:g} % of J: {} of {}.\n",
        problems, registered, not_available, problems - registered - not_available, unconverged,
        iterations.empty() ? 0 : iterations[iterations.size() / 2], iterations.empty() ? 0 : iterations.back(), above,
        compared, 100 * kAboveBest, kEndTolerance, 100 * kCostTolerance, off, checked);
  }
};

// Whether it is solved in its own mode.
bool is_compared(const BankProblem& problem, const Settings& settings) {
  return settings.noise_mode.empty() || problem.options.noise.spec() == "none";
}

std::vector<BankProblem> chosen_problems(const Settings& settings) {
  std::vector<BankProblem> problems = bank_problems(settings.folders);
  const std::regex only(settings.only);
  std::erase_if(problems, [&](const BankProblem& problem) {
    return (problem.large && !settings.large) || !std::regex_search(problem.name, only);
  });
  for (BankProblem& problem : problems) {
    if (is_compared(problem, settings)) continue;
    problem.mode = settings.noise_mode;
    problem.closed_form.reset();
  }
  return problems;
}

void lower(BestTable& table, const BankProblem& problem, const Outcome& outcome, const std::string& integrator) {
  if (outcome.status != Status::kChecked || !outcome.converged || !cost_agrees(outcome)) return;
  const std::string chosen = integrator == "auto" ? "" : " --integrator " + integrator;
  table.lower(problem.name, fmt::format("{:.6g}", outcome.cost.total()),
              fmt::format("matching_bank --only '^{}$'{}", problem.name, chosen));
}

void run(const Settings& settings) {
  const BestTable table(settings.best);
  const std::vector<BankProblem> problems = chosen_problems(settings);
  const auto best_of = [&](const BankProblem& problem) {
    return is_compared(problem, settings) ? table.find(problem.name) : nullptr;
  };
  Summary summary;
  std::vector<Child> children;
  std::vector<Result> results;
  print_head();
  for (const BankProblem& problem : problems) {
    const std::size_t ahead = std::min(problems.size(), results.size() + static_cast<std::size_t>(settings.jobs));
    while (children.size() < ahead) children.push_back(start(problems[children.size()], settings));
    results.push_back(finish(children[results.size()], settings.limit));
    print_row(problem, results.back(), best_of(problem));
    summary.add(results.back().outcome, best_of(problem));
  }
  summary.print();
  if (!settings.update) return;
  BestTable lowered(settings.best);  // another run may have written it
  for (std::size_t i = 0; i < problems.size(); ++i)
    if (is_compared(problems[i], settings)) lower(lowered, problems[i], results[i].outcome, settings.integrator);
  lowered.write(settings.best);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App program("Registers a bank of matching problems");
  Settings settings;
  const std::string source = PULSON_SOURCE_DIR;
  settings.best = source + "/benchmarks/matching_bank.txt";
  settings.folders.sample_shapes = source + "/sample_shapes";
  program.add_option("--problems", settings.folders.problems, "folder of P1_20_source.csv, …")
      ->envname("PULSON_PROBLEMS");
  program.add_option("--data", settings.folders.data, "folder of real landmark files")->envname("PULSON_DATA");
  program.add_option("--only", settings.only, "regular expression: problems whose name has a match");
  program.add_flag("--large", settings.large, "also problems of 2000 landmarks and more");
  program.add_option("--limit", settings.limit, "CPU seconds for a problem")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  program.add_option("--jobs", settings.jobs, "problems at a time")->check(CLI::PositiveNumber)->capture_default_str();
  program.add_option("--threads", settings.threads, "threads of each")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  program.add_option("--noise-mode", settings.noise_mode,
                     "mode of all problems with noise, which are then not compared with the best known");
  program.add_option("--integrator", settings.integrator, "of all problems")->capture_default_str();
  program.add_option("--best", settings.best, "file of the lowest J known");
  program.add_flag("--update", settings.update, "lower them where a result is lower, converged and checked");
  CLI11_PARSE(program, argc, argv);
  try {
    run(settings);
  } catch (const std::exception& error) {
    fmt::print(stderr, "matching_bank: {}\n", error.what());
    return 2;
  }
}
