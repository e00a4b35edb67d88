// Whatever call of the operating system fails, and whenever Ctrl-C comes: files hold what they held before or all that
// is new, numbers never go for a picture's sake, and the program ends with one of its own exit codes.

#include <algorithm>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <map>
#include <random>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include "temporary_folder.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;

/// The smallest run of a verb. Its results are in the folder `out`.
struct Verb {
  std::string name;
  std::vector<std::string> before;     ///< what the run needs, a command each
  std::vector<std::string> arguments;  ///< of the run
  std::vector<std::string> other;      ///< that make other results, which are there before
  std::string last;                    ///< the file that is put in place after all other numbers
  bool together = true;                ///< whether all files are old or all are new; else each of them is
};

/// How a run ended and what it left.
struct Ending {
  int status = 0;
  std::string printed;
  std::map<std::string, std::string> numbers;  ///< of `out`
  std::vector<std::string> leftovers;          ///< hidden files that nobody removed
};

void PrintTo(const Verb& verb, std::ostream* stream) { *stream << verb.name; }

std::vector<std::string> words(const std::string& line) {
  std::istringstream stream(line);
  return {std::istream_iterator<std::string>(stream), std::istream_iterator<std::string>()};
}

bool is_every_place_asked_for() { return std::getenv("PULSON_EVERY_FAULT") != nullptr; }

class Faults : public InTemporaryFolder, public testing::WithParamInterface<Verb> {
 protected:
  void SetUp() override {
    InTemporaryFolder::SetUp();
    for (const std::string shape : {"fish_source", "fish_target", "leaves"}) {
      const fs::path from = fs::path(PULSON_SOURCE_DIR) / "sample_shapes";
      const std::string file = shape + (shape == "leaves" ? ".tps" : ".csv");
      fs::copy_file(from / file, file);
    }
    fs::copy_file(fs::path(PULSON_SOURCE_DIR) / "sample_shapes/discs.png", "discs.png");
    write("a.csv", "0,0\n1,0\n0,1\n1.2,1\n");
    write("b.csv", "0,0.1\n1.1,0\n0,1\n1.2,1.3\n");
    write("three.tps",
          "LM=4\n0 0\n1 0\n0 1\n1 1\nID=a\nLM=4\n0 0.1\n1 0\n0 1.2\n1 1\nID=b\nLM=4\n0 0\n1.2 0\n0.1 1\n1 1\nID=c\n");
    for (const std::string& command : GetParam().before) ASSERT_EQ(run_plainly(words(command)), 0) << command;
    if (!GetParam().other.empty()) {
      ASSERT_THAT(run_plainly(with(GetParam().other)), testing::AnyOf(0, 3));
    }
    fs::create_directory("out");
    fs::copy("out", "old", fs::copy_options::recursive);
  }

  static std::vector<std::string> with(std::vector<std::string> more) {
    more.insert(more.begin(), GetParam().arguments.begin(), GetParam().arguments.end());
    return more;
  }

  static int run_plainly(const std::vector<std::string>& arguments) { return started(arguments, {}); }

  /// The former results.
  static void restore() {
    fs::remove_all("out");
    fs::copy("old", "out", fs::copy_options::recursive);
  }

  /// The run, in a folder that holds the former results, with that fault.
  static Ending run_with(const std::string& fault) {
    restore();
    fs::remove("calls");
    Ending ending;
    ending.status = started(GetParam().arguments, fault);
    ending.printed = contents("printed");
    for (const auto& entry : fs::recursive_directory_iterator(".")) {
      const std::string name = entry.path().filename();
      if (name.starts_with(".") && name != ".") ending.leftovers.push_back(entry.path().string());
    }
    ending.numbers = numbers();
    return ending;
  }

  /// The numbers of `out` as they are.
  static std::map<std::string, std::string> numbers() {
    std::map<std::string, std::string> found;
    for (const auto& entry : fs::recursive_directory_iterator("out"))
      if (is_of_numbers(entry.path())) found[entry.path().string()] = without_times(contents(entry.path()));
    return found;
  }

  static std::vector<std::string> calls() {
    std::ifstream stream("calls");
    std::vector<std::string> lines;
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
  }

 private:
  static bool is_of_numbers(const fs::path& path) {
    const std::set<std::string> kinds = {".json", ".csv", ".npy", ".tps", ".tif"};
    return kinds.contains(path.extension().string()) && fs::is_regular_file(path) &&
           !path.filename().string().starts_with(".");
  }

  /// Without the numbers that differ from run to run.
  static std::string without_times(const std::string& text) {
    std::istringstream stream(text);
    std::string kept;
    for (std::string line; std::getline(stream, line);)
      if (line.find("seconds\"") == std::string::npos) kept += line + '\n';
    return kept;
  }

  /// In a process group of its own. @return its exit code, or minus the number of the signal that ended it
  static int started(const std::vector<std::string>& arguments, const std::string& fault) {
    const pid_t child = ::fork();
    if (child == 0) {
      ::setpgid(0, 0);
      const int file = ::open("printed", O_WRONLY | O_CREAT | O_TRUNC, 0600);
      ::dup2(file, STDOUT_FILENO);
      ::dup2(file, STDERR_FILENO);
      if (!fault.empty()) {
        ::setenv("LD_PRELOAD", PULSON_FAULT_SHIM, 1);
        ::setenv("PULSON_FAULT_LOG", "calls", 1);
        ::setenv("PULSON_FAULT", fault.c_str(), 1);
      }
      std::vector<std::string> strings = {PULSON_PROGRAM};
      strings.insert(strings.end(), arguments.begin(), arguments.end());
      std::vector<char*> pointers;
      for (std::string& string : strings) pointers.push_back(string.data());
      pointers.push_back(nullptr);
      ::alarm(120);
      ::execv(PULSON_PROGRAM, pointers.data());
      ::_exit(127);
    }
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }
};

/// The first call of each kind, the last, and others by chance: 20 in all, or each of them where PULSON_EVERY_FAULT is
/// set.
std::vector<int> places(const std::vector<std::string>& calls) {
  constexpr std::size_t kMost = 20;
  std::set<int> chosen;
  std::set<std::string> kinds;
  for (std::size_t i = 0; i < calls.size(); ++i)
    if (is_every_place_asked_for() || kinds.insert(calls[i].substr(0, calls[i].find(' '))).second)
      chosen.insert(static_cast<int>(i) + 1);
  chosen.insert(static_cast<int>(calls.size()));
  std::mt19937 engine(20261126);
  while (chosen.size() < std::min(kMost, calls.size()) && !is_every_place_asked_for())
    chosen.insert(static_cast<int>(engine() % calls.size()) + 1);
  return {chosen.begin(), chosen.end()};
}

int error_for(const std::string& call) {
  const std::map<std::string, int> errors = {{"open", EMFILE},  {"write", ENOSPC}, {"rename", EACCES}, {"link", EPERM},
                                             {"mkdir", ENOSPC}, {"mmap", ENOMEM},  {"spawn", EAGAIN}};
  return errors.at(call.substr(0, call.find(' ')));
}

/// Whether the last file had its name before the call at `place`, counted from 1; calls for memory differ by a few from
/// run to run.
bool was_committed(const std::vector<std::string>& calls, int place, const std::string& last) {
  const auto end = calls.begin() + std::min<std::ptrdiff_t>(place - 1, std::ssize(calls));
  return std::any_of(calls.begin(), end,
                     [&](const std::string& call) { return call.starts_with("rename ") && call.ends_with(last); });
}

std::vector<std::string> names(const std::map<std::string, std::string>& files) {
  std::vector<std::string> all;
  for (const auto& [name, text] : files) all.push_back(name);
  return all;
}

bool are_old_or_new(const Ending& ending, const Ending& whole, const std::map<std::string, std::string>& old) {
  return std::all_of(ending.numbers.begin(), ending.numbers.end(), [&](const auto& file) {
    const auto before = old.find(file.first), after = whole.numbers.find(file.first);
    return (before != old.end() && before->second == file.second) ||
           (after != whole.numbers.end() && after->second == file.second);
  });
}

void check(const Ending& ending, const Ending& whole, const std::map<std::string, std::string>& old, bool is_committed,
           bool may_die, bool together) {
  const bool has_died = may_die && (ending.status == -SIGINT || ending.status == -SIGTERM);
  // Then the best that the search had found is written, all of it.
  if (may_die && ending.status == 3 && ending.printed.find("not converged: interrupted") != std::string::npos) {
    EXPECT_EQ(names(ending.numbers), names(whole.numbers));
    EXPECT_THAT(ending.leftovers, testing::IsEmpty());
    return;
  }
  EXPECT_TRUE(has_died || ending.status == 0 || ending.status == 2 || ending.status == 3) << ending.status;
  EXPECT_TRUE(ending.numbers == old || ending.numbers == whole.numbers ||
              (!together && are_old_or_new(ending, whole, old)))
      << "neither the old numbers nor the new";
  if (ending.status == whole.status) {
    EXPECT_EQ(ending.numbers, whole.numbers) << "it is said to be done";
  }
  if (is_committed) {
    EXPECT_EQ(ending.status, whole.status) << "the numbers were there already";
    EXPECT_EQ(ending.numbers, whole.numbers) << "the numbers were there already";
  }
  if (ending.status == 2) {
    EXPECT_THAT(ending.printed, testing::HasSubstr("pulson: "));
  }
  if (!has_died) {
    EXPECT_THAT(ending.leftovers, testing::IsEmpty());
  }
}

TEST_P(Faults, LeaveOldFilesOrNewOnes) {
  const Ending whole = run_with("0:0");
  ASSERT_THAT(whole.status, testing::AnyOf(0, 3)) << whole.printed;
  const std::vector<std::string> made = calls();
  ASSERT_EQ(run_with("0:0").numbers, whole.numbers) << "two runs differ";
  restore();
  const std::map<std::string, std::string> old = numbers();
  for (const int place : places(made)) {
    const std::string& call = made[static_cast<std::size_t>(place) - 1];
    for (const std::string& what : {std::to_string(error_for(call)), std::string("SIGINT")}) {
      SCOPED_TRACE("call " + std::to_string(place) + " of " + std::to_string(made.size()) + ": " + call + ", " + what);
      const Ending ending = run_with(std::to_string(place) + ":" + what);
      SCOPED_TRACE(ending.printed);
      check(ending, whole, old, was_committed(calls(), place, GetParam().last), what == "SIGINT", GetParam().together);
    }
  }
}

const std::string kLine = "--kernel gaussian:alpha=1 --noise ch-sd:beta=0.5";

std::vector<Verb> verbs() {
  const auto of = [](const std::string& name, const std::vector<std::string>& before, const std::string& arguments,
                     const std::string& other, const std::string& last, bool together = true) {
    return Verb{name, before, words(arguments), words(other), last, together};
  };
  const std::string registration = "register a.csv b.csv -o registered --no-picture --align none";
  return {
      of("register", {}, "register a.csv b.csv -o out --threads 1", "--sigma 5%", "registration.json"),
      of("register_cohort", {}, "register three.tps -o out --threads 1", "--sigma 5%", "cohort.json"),
      of("atlas", {}, "atlas three.tps -o out --threads 1", "--sigma 5%", "atlas.json"),
      of("simulate", {}, "simulate --q 0,1 --p 1,0 --steps 5 -o out --threads 1 " + kLine, "--seed 2",
         "simulation.json"),
      of("ensemble", {}, "ensemble --q 0,1 --p 1,0 --steps 5 --time 1 --samples 128 -o out --threads 1 " + kLine,
         "--seed 2", "ensemble.json"),
      of("merge",
         {"ensemble --q 0,1 --p 1,0 --steps 5 --time 1 --samples 128 -o parts --shard 1/2 " + kLine,
          "ensemble --q 0,1 --p 1,0 --steps 5 --time 1 --samples 128 -o parts --shard 2/2 " + kLine},
         "merge parts/part-1-of-2.ensemble parts/part-2-of-2.ensemble -o out --threads 1", "", "ensemble.json"),
      of("compare", {}, "compare three.tps -o out --sigma 0.1 --noise none --threads 1", "--seed 2", "comparison.json"),
      of("sample", {},
         "sample a.csv b.csv -o out --noise ch-sd:beta=5% --align none --steps 4 --chains 2 --draws "
         "20 "
         "--warmup 20 --threads 1",
         "--seed 2", "summary.json"),
      of("fokker_planck", {},
         "fokker-planck --q 0,2 --p 1,0.5 --time 0.5 --grids 2 --samples 0 -o out --threads 1 " + kLine, "",
         "fokker_planck.json"),
      of("warp_image", {registration},
         "warp registered discs.png -o out/w.tif --json out/w.json --report out/w.html --pixel-size 0.01 --threads 1",
         "", "w.json", false),
      of("warp_points", {registration}, "warp registered a.csv -o out/w.csv --json out/w.json --threads 1", "",
         "w.json", false),
      of("convert", {}, "convert three.tps out/three.csv", "", "three.csv")};
}

INSTANTIATE_TEST_SUITE_P(Verbs, Faults, testing::ValuesIn(verbs()), [](const auto& verb) { return verb.param.name; });

}  // namespace
}  // namespace pulson
