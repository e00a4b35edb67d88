// Command lines, configurations and environments made by chance: whatever they are, the program ends with an exit code
// of its own, one line where it refuses, and runs nothing that they name.

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <random>
#include <regex>
#include <string>
#include <utility>
#include <vector>

#include <fcntl.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include "temporary_folder.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using Words = std::vector<std::string>;
using Environment = std::vector<std::pair<std::string, std::string>>;

const Words kVerbs = {"register", "atlas",         "warp",      "simulate", "ensemble", "merge",     "compare",
                      "sample",   "fokker-planck", "reproduce", "convert",  "info",     "completion"};

/// Texts that other programs have stumbled over, and some that are right.
Words hostile_texts() {
  return {"",
          "-",
          "--",
          "-1",
          "0",
          "1",
          "2",
          "3",
          "0.5",
          "nan",
          "inf",
          "1e308",
          "1e-308",
          "0x10",
          "1e",
          "x",
          "'",
          "\"",
          "\\",
          "<touch PWNED;#",
          "|touch PWNED",
          "$(touch PWNED)",
          "`touch PWNED`",
          ";touch PWNED",
          "--config=e.toml",
          "-o",
          "/dev/zero",
          "/dev/full",
          "/dev/null",
          ".",
          "a.csv",
          "b.csv",
          "none.csv",
          "three.tps",
          "three.tps#2",
          "a.csv#9",
          "a.csv#id=x",
          "out",
          "loop",
          "dangling",
          "pipe",
          "picture.png",
          "1,2",
          "0,1,2",
          "1/2",
          "3/2",
          "0/0",
          "5%",
          "-5%",
          "auto",
          "fit",
          "none",
          "all",
          "mean",
          "ch-sd:beta=5%",
          "gaussian:alpha=1",
          "p-sd:beta=1,fields=grid,count=2",
          "kunita:beta=1",
          "ch-sd",
          "ch-sd:beta=1:fit(0.5)",
          "fit",
          "variational",
          "rk4",
          "png",
          "svg,pdf",
          "\xff\xfe",
          "\x1b[2J\x1b]0;x\x07",
          "a\nb",
          "a\tb",
          "%s%n%d",
          "\xe2\x80\xae"
          "gpj.exe",
          std::string(300, 'n'),
          std::string(5000, 'n'),
          "../a.csv",
          "{}"};
}

class CommandLines : public InTemporaryFolder {
 protected:
  void SetUp() override {
    InTemporaryFolder::SetUp();
    write("a.csv", "0,0\n1,0\n0,1\n1.2,1\n");
    write("b.csv", "0,0.1\n1.1,0\n0,1\n1.2,1.3\n");
    write("three.tps",
          "LM=4\n0 0\n1 0\n0 1\n1 1\nIMAGE=--config=e.toml\nID=a\nLM=4\n0 0.1\n1 0\n0 1.2\n1 1\nIMAGE=<touch "
          "PWNED\nID='b\n"
          "LM=4\n0 0\n1.2 0\n0.1 1\n1 1\nID=c d\n");
    write("--config=e.toml", "");
    write("e.toml", "side-by-side = \"<touch PWNED;#/s.png\"\njson = \"victim\"\n");
    write("picture.png", "no picture");
    write("victim", "as it was");
    fs::create_symlink("loop", "loop");
    fs::create_symlink("not there", "dangling");
    ASSERT_EQ(::mkfifo("pipe", 0600), 0);
  }

  struct Ending {
    int status = 0;
    std::string out, err;
  };

  static Ending run(const Words& arguments, const Environment& environment = {}) {
    const pid_t child = ::fork();
    if (child == 0) become_program(arguments, environment);
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    return {WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), contents("printed"), contents("errors")};
  }

  static void expect_in_order(const Ending& ending) {
    EXPECT_THAT(ending.status, testing::AnyOf(0, 2, 3)) << ending.err;
    if (ending.status == 2) {
      EXPECT_THAT(ending.err, testing::HasSubstr("pulson: "));
    }
    for (const char c : ending.err + ending.out)
      EXPECT_TRUE(c == '\n' || c == '\t' || static_cast<unsigned char>(c) >= 0x20) << static_cast<int>(c);
    EXPECT_FALSE(fs::exists("PWNED"));
    EXPECT_EQ(contents("victim"), "as it was");
    EXPECT_EQ(contents("a.csv"), "0,0\n1,0\n0,1\n1.2,1\n") << "an input was overwritten";
  }

 private:
  [[noreturn]] static void become_program(const Words& arguments, const Environment& environment) {
    const int flags = O_WRONLY | O_CREAT | O_TRUNC;
    ::dup2(::open("/dev/null", O_RDONLY), STDIN_FILENO);
    ::dup2(::open("printed", flags, 0600), STDOUT_FILENO);
    ::dup2(::open("errors", flags, 0600), STDERR_FILENO);
    for (const auto& [name, value] : environment) ::setenv(name.c_str(), value.c_str(), 1);
    Words words = {PULSON_PROGRAM};
    words.insert(words.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& word : words) pointers.push_back(word.data());
    pointers.push_back(nullptr);
    ::alarm(60);
    ::execv(PULSON_PROGRAM, pointers.data());
    ::_exit(127);
  }
};

int count_of(const char* name, int usual) {
  const char* const given = std::getenv(name);
  return given == nullptr ? usual : std::atoi(given);
}

/// The long options that the help of a verb names.
Words options_in(const std::string& help) {
  const std::regex option("--[a-z][a-z0-9-]*");
  Words options{std::sregex_token_iterator(help.begin(), help.end(), option), {}};
  std::sort(options.begin(), options.end());
  options.erase(std::unique(options.begin(), options.end()), options.end());
  return options;
}

TEST_F(CommandLines, MadeByChanceEndInOrder) {
  std::mt19937 engine(20261126);
  const Words texts = hostile_texts();
  const auto any = [&](const Words& of) { return of[engine() % of.size()]; };
  for (int turn = count_of("PULSON_COMMAND_LINES", 240); turn > 0; --turn) {
    const std::string verb = any(kVerbs);
    const Words options = options_in(run({verb, "--help-all"}).out);
    Words line = {verb};
    for (auto k = engine() % 3; k > 0; --k) line.push_back(any({"a.csv", "b.csv", "three.tps", any(texts)}));
    if (engine() % 4 > 0) line.insert(line.end(), {"-o", engine() % 3 > 0 ? "out" : any(texts)});
    for (auto k = engine() % 4; k > 0 && !options.empty(); --k) {
      const std::string option = any(options);
      if (engine() % 4 == 0)
        line.push_back(option + "=" + any(texts));
      else
        line.insert(line.end(), {option, any(texts)});
    }
    SCOPED_TRACE(testing::PrintToString(line));
    expect_in_order(run(line));
  }
}

TEST_F(CommandLines, WithConfigurationsMadeByChanceEndInOrder) {
  std::mt19937 engine(7);
  const Words texts = hostile_texts(), options = options_in(run({"register", "--help-all"}).out);
  const Words values = {"1", "true", "[1, 2]", "\"x\"", "\"\"", "1979-05-27", "nan", "{a = 1}", "'''x'''", "[[]]", ""};
  const auto any = [&](const Words& of) { return of[engine() % of.size()]; };
  for (int turn = count_of("PULSON_COMMAND_LINES", 120); turn > 0; --turn) {
    std::string text;
    for (auto k = engine() % 5; k > 0; --k) {
      if (engine() % 5 == 0) text += "[" + any(kVerbs) + "]\n";
      text += any(options).substr(2) + (engine() % 8 == 0 ? any(texts) : " = ") + any(values) + "\n";
    }
    write("c.toml", text);
    SCOPED_TRACE(text);
    expect_in_order(run({"register", "a.csv", "b.csv", "-o", "out", "--config", "c.toml"}));
  }
}

TEST_F(CommandLines, InEnvironmentsMadeByChanceEndInOrder) {
  std::mt19937 engine(9);
  const Words names = {"TERM",
                       "NO_COLOR",
                       "COLUMNS",
                       "HOME",
                       "TMPDIR",
                       "PATH",
                       "LANG",
                       "LC_ALL",
                       "TZ",
                       "XDG_CONFIG_HOME",
                       "FONTCONFIG_FILE",
                       "FONTCONFIG_PATH",
                       "OMP_NUM_THREADS",
                       "OPENBLAS_NUM_THREADS",
                       "SLURM_NTASKS"};
  const Words texts = hostile_texts();
  const auto any = [&](const Words& of) { return of[engine() % of.size()]; };
  for (int turn = count_of("PULSON_COMMAND_LINES", 60); turn > 0; --turn) {
    Environment environment;
    for (auto k = 1 + engine() % 3; k > 0; --k) environment.emplace_back(any(names), any(texts));
    SCOPED_TRACE(testing::PrintToString(environment));
    const Ending ending = run({"register", "a.csv", "b.csv", "-o", "out"}, environment);
    expect_in_order(ending);
    EXPECT_EQ(ending.status, 0) << "the environment is none of the run's business: " << ending.err;
  }
}

}  // namespace
}  // namespace pulson
