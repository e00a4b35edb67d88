// What the program shows on a terminal, and not in a pipe: colours, progress, lines as wide as it is. And how much it
// tells, by --quiet and --verbose.

#include <array>
#include <cmath>
#include <csignal>
#include <map>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <pty.h>

#include "program.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::EndsWith;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

constexpr const char* kErase = "\r\x1b[K";

class TerminalProgram : public Program {
 protected:
  using Environment = std::map<std::string, std::string>;

  struct Shown {
    int status = 0;
    std::string text;
  };

  void SetUp() override {
    Program::SetUp();
    write("a.csv", "x,y\n0,0\n1,0\n0,1\n");
    write("b.csv", "x,y\n0,0\n1.1,0\n0,1.2\n");
  }

  /// Runs the program on a terminal of its own. Where `until` is seen it gets Ctrl-C.
  static Shown on_terminal(const Arguments& arguments, const Environment& environment = {},
                           const std::string& until = "", unsigned short columns = 80) {
    winsize size{};
    size.ws_row = 24;
    size.ws_col = columns;
    int terminal = -1;
    const pid_t child = ::forkpty(&terminal, nullptr, nullptr, &size);
    if (child == 0) become_program(arguments, environment);
    Shown shown;
    bool interrupted = until.empty();
    std::array<char, 4096> buffer{};
    for (ssize_t count = 0; (count = ::read(terminal, buffer.data(), buffer.size())) > 0;) {
      shown.text.append(buffer.data(), static_cast<std::size_t>(count));
      if (interrupted || shown.text.find(until) == std::string::npos) continue;
      interrupted = true;
      EXPECT_EQ(::write(terminal, "\x03", 1), 1);
    }
    EXPECT_TRUE(interrupted) << shown.text;
    EXPECT_EQ(::waitpid(child, &shown.status, 0), child);
    ::close(terminal);
    return shown;
  }

  static std::size_t widest(const std::string& text) {
    std::size_t most = 0;
    std::istringstream stream(text);
    for (std::string line; std::getline(stream, line);)
      if (line.rfind("  pulson", 0) != 0)  // commands stay whole
        most = std::max(most, static_cast<std::size_t>(std::count_if(
                                  line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80 && c != '\r'; })));
    return most;
  }

 private:
  [[noreturn]] static void become_program(Arguments arguments, const Environment& environment) {
    ::unsetenv("NO_COLOR");
    ::setenv("TERM", "xterm", 1);
    for (const auto& [name, value] : environment) ::setenv(name.c_str(), value.c_str(), 1);
    arguments.insert(arguments.begin(), PULSON_PROGRAM);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    std::signal(SIGINT, SIG_DFL);  // which shells make jobs in the background ignore
    ::alarm(kPatience);
    ::execv(PULSON_PROGRAM, pointers.data());
    ::_exit(127);
  }
};

TEST_F(TerminalProgram, ColoursMessages) {
  EXPECT_THAT(on_terminal({"regster"}).text, StartsWith("\x1b[1;31mpulson:\x1b[0m unknown verb"));
  EXPECT_THAT(on_terminal({"regster"}, {{"NO_COLOR", ""}}).text, StartsWith("\x1b[1;31m")) << "empty is unset";
  for (const Environment& plain :
       {Environment{{"NO_COLOR", "1"}}, Environment{{"TERM", "dumb"}}, Environment{{"TERM", ""}}})
    EXPECT_THAT(on_terminal({"regster"}, plain).text, StartsWith("pulson: unknown verb"));
  EXPECT_THAT(run({"regster"}).err, StartsWith("pulson: unknown verb"));
  const Arguments still = words("register a.csv b.csv -o out --no-picture --max-iterations 0 --lambda 1e9");
  EXPECT_THAT(on_terminal(still).text, HasSubstr("\x1b[33mwarning:\x1b[0m "));
  EXPECT_THAT(run(still).err, AllOf(HasSubstr("warning: "), Not(HasSubstr("\x1b"))));
}

TEST_F(TerminalProgram, ShowsABarWhereTheEndIsKnown) {
  const Arguments long_run =
      words("ensemble --q 0,10 --p 4,1 --noise ch-sd:beta=1.5 --samples 100000000 --no-picture -o out");
  const Shown shown = on_terminal(long_run, {}, " left");
  EXPECT_THAT(shown.text, AllOf(StartsWith(std::string(kErase) + "["), HasSubstr(" % "), HasSubstr(" paths")));
  EXPECT_EQ(WEXITSTATUS(shown.status), 3) << "what there is was written";
  const std::size_t bar_end = shown.text.rfind(kErase);
  EXPECT_EQ(shown.text.substr(bar_end).find(" left"), std::string::npos) << "the bar goes away";
}

TEST_F(TerminalProgram, RegisterWritesWhatItFoundBeforeCtrlC) {
  std::string source = "x,y\n", target = source;
  for (int i = 0; i < 400; ++i) {
    source += fmt::format("{},{}\n", std::cos(0.0157 * i), std::sin(0.0157 * i));
    target += fmt::format("{},{}\n", std::cos(0.0157 * i), std::sin(0.0157 * i) + 0.4 * std::cos(0.05 * i));
  }
  write("large_a.csv", source);
  write("large_b.csv", target);
  const Shown shown =
      on_terminal(words("register large_a.csv large_b.csv -o kept --tolerance 1e-12 --steps 60"), {}, "iteration ");
  EXPECT_EQ(WEXITSTATUS(shown.status), 3) << shown.text;
  EXPECT_THAT(shown.text, HasSubstr("not converged: interrupted after "));
  for (const char* file : {"registration.json", "residuals.csv", "trajectory.csv", "registration.png", "report.html"})
    EXPECT_TRUE(std::filesystem::exists(std::string("kept/") + file)) << file;
  EXPECT_EQ(read_json("kept/registration.json")["converged"], false);
  EXPECT_EQ(read_json("kept/registration.json")["stop_reason"], "interrupted");
}

TEST_F(TerminalProgram, TakesTheBarAwayWhereCtrlCStopsIt) {
  const Arguments study = words(
      "compare a.csv -o out --simulate none --true-lambda 1 --count 1000000 --noise none --sigma 0.05 --no-picture");
  const Shown shown = on_terminal(study, {}, " left");
  EXPECT_EQ(WEXITSTATUS(shown.status), 3);
  const std::size_t bar_end = shown.text.rfind(kErase);
  EXPECT_THAT(shown.text.substr(bar_end), HasSubstr("partial: "));
  EXPECT_EQ(shown.text.substr(bar_end).find(" left"), std::string::npos);
}

TEST_F(TerminalProgram, CountsTheMatchesOfAModelOfCompare) {
  std::string shapes = "specimen,landmark,x,y\n";
  for (int shape = 0; shape < 300; ++shape)
    for (int i = 0; i < 20; ++i) {
      const int row = i / 5;
      shapes += "s" + std::to_string(shape) + "," + std::to_string(i + 1) + "," +
                std::to_string(i % 5 + 0.1 * std::sin(shape + i)) + "," + std::to_string(row + 0.001 * shape) + "\n";
    }
  write("shapes.csv", shapes);
  const Shown shown = on_terminal(
      words("compare shapes.csv -o out --sigma 0.01 --steps 20 --noise none --noise ch-sd:beta=fit --no-picture"), {},
      " matches of ");
  EXPECT_EQ(WTERMSIG(shown.status), SIGINT);
  EXPECT_THAT(shown.text, testing::ContainsRegex("model 1/2: [0-9]+ matches of 300 shapes"));
  EXPECT_THAT(shown.text, EndsWith(kErase));
}

TEST_F(TerminalProgram, ShowsHowFarAnAuditIs) {
  std::string shapes = "specimen,landmark,x,y\n";
  for (int shape = 0; shape < 300; ++shape)
    for (int i = 0; i < 80; ++i)
      shapes += fmt::format("s{},{},{},{}\n", shape, i + 1, std::cos(0.08 * i) + 0.01 * std::sin(shape * i + 1.0),
                            std::sin(0.08 * i) + 0.01 * std::cos(shape + i * i));
  write("cohort.csv", shapes);
  const Shown shown = on_terminal(words("audit cohort.csv -o out --fix mended.csv"), {}, " left");
  EXPECT_EQ(WTERMSIG(shown.status), SIGINT) << shown.text;
  EXPECT_THAT(shown.text, AllOf(HasSubstr(" % "), HasSubstr("judging"), EndsWith(kErase)));
  EXPECT_FALSE(std::filesystem::exists("mended.csv"));
  EXPECT_FALSE(std::filesystem::exists("out/audit.json"));
}

TEST_F(TerminalProgram, KeepsProgressToTheWidth) {
  const Arguments long_run =
      words("ensemble --q 0,10 --p 4,1 --noise ch-sd:beta=1.5 --samples 100000000 --no-picture -o out");
  const std::string text = on_terminal(long_run, {}, " % ", 30).text;
  const std::size_t begin = text.find(kErase) + std::string(kErase).size();
  EXPECT_LT(text.find_first_of("\r^", begin) - begin, 30U);
}

TEST_F(TerminalProgram, ShowsNoProgressInAPipe) {
  const ProgramRun done =
      run(words("ensemble --q 0,10 --p 4,1 --noise ch-sd:beta=1.5 --samples 100000000 --stop-after 60000 --no-picture "
                "--quiet -o out"));
  EXPECT_THAT(done.err, Not(HasSubstr("\r")));
  EXPECT_EQ(count_lines(done.err), 1U) << "the warning that it is partial";
}

TEST_F(TerminalProgram, WrapsHelpAtTheWidth) {
  for (const std::string verb : {"register", "warp", "ensemble", "reproduce"}) {
    EXPECT_LE(widest(run({verb, "--help"}).out), 100U) << verb;
    EXPECT_LE(widest(on_terminal({verb, "--help"}, {}, "", 80).text), 80U) << verb;
    EXPECT_LE(widest(on_terminal({verb, "--help"}, {}, "", 40).text), 80U) << verb;
    EXPECT_GT(widest(on_terminal({verb, "--help"}, {}, "", 140).text), 100U) << verb;
  }
}

TEST_F(TerminalProgram, TellsAsMuchAsIsAsked) {
  const Arguments fit = words("register a.csv b.csv -o out --no-picture");
  const ProgramRun usual = run(fit);
  EXPECT_EQ(usual.err, "");
  EXPECT_THAT(usual.out, HasSubstr("rms "));
  const ProgramRun quiet = run(joined(fit, {"-q"}));
  EXPECT_EQ(quiet.out + quiet.err, "");
  const ProgramRun verbose = run(joined(fit, {"-v"}));
  EXPECT_EQ(verbose.out.substr(0, 40), usual.out.substr(0, 40));
  EXPECT_THAT(verbose.err, AllOf(HasSubstr(" s read a.csv and b.csv: 3 and 3 landmarks in 2D\n"),
                                 HasSubstr(" s iteration 1: cost "), HasSubstr(" s fitted: kernel matern32:alpha="),
                                 HasSubstr(" s wrote the results\n"), Not(HasSubstr("\r"))));
  // Of every verb that takes long, so that no part of it is dark.
  for (const auto& [command, step] :
       {std::pair{"sample a.csv b.csv --steps 2 --chains 1 --warmup 4 --draws 8", " s sampled and confirmed"},
        std::pair{"sample a.csv b.csv --chains 1 --warmup 4 --draws 8", " s chose "},
        std::pair{"compare a.csv b.csv --noise none --steps 4", " s compared the models\n"},
        std::pair{"atlas a.csv b.csv --max-iterations 2", " s matched the shapes\n"}})
    EXPECT_THAT(run(words(std::string(command) + " -v -o steps")).err,
                AllOf(HasSubstr(" s read "), HasSubstr(step), HasSubstr(" s wrote the numbers\n"),
                      HasSubstr(" s drew "), HasSubstr(" s wrote the results\n")))
        << command;
  const ProgramRun both = run(joined(fit, words("-q -v")));
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_EQ(count_lines(both.err), 1U);
  EXPECT_EQ(run(words("convert a.csv c.csv -q")).out, "");
  EXPECT_THAT(run(words("convert a.csv d.csv -v")).err, HasSubstr(" s read a.csv: csv\n"));
}

}  // namespace
}  // namespace pulson
