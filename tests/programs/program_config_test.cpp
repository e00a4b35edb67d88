// Options from a file: --config, and --print-config, which writes one.

#include <gmock/gmock.h>

#include "program.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class ConfiguredProgram : public Program {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("a.csv", "x,y\n0,0\n1,0\n0,1\n");
    write("b.csv", "x,y\n0,0\n1.1,0\n0,1.2\n");
  }

  static nlohmann::json registered(const std::string& line) {
    const ProgramRun done = run(words(line));
    EXPECT_EQ(done.exit_code, 0) << done.err;
    return read_json("out/registration.json");
  }

  /// What is said of a configuration that is wrong.
  static std::string complaint(const std::string& file, const std::string& text, const std::string& more = "") {
    write(file, text);
    const ProgramRun done = run(words("register a.csv b.csv -o out --no-picture --config " + file + " " + more));
    EXPECT_EQ(done.exit_code, 2) << text;
    EXPECT_EQ(done.out, "");
    EXPECT_EQ(count_lines(done.err), 1U) << done.err;
    EXPECT_FALSE(std::filesystem::exists("out"));
    return done.err;
  }
};

constexpr const char* kToml =
    "# a run\n"
    "no-picture = true\n"
    "kernel = \"gaussian:alpha=0.3\"  # narrow\n"
    "\n"
    "[register]\r\n"
    "source = 'a.csv'\n"
    "target = \"b\\u002Ecsv\"\n"
    "steps = 1_0\n"
    "sigma = 5e-2\n"
    "noise = \"ch-sd:beta=0.5\"\n"
    "out = \"out\"\n"
    "[compare]\n"
    "noise = [\"none\", \"ch-sd\"]\n"
    "folds = 0\n";

TEST_F(ConfiguredProgram, TakesItsOptionsFromToml) {
  write("run.toml", kToml);
  const nlohmann::json json = registered("register --config run.toml");
  EXPECT_EQ(json["steps"], 10);
  EXPECT_EQ(json["sigma"], 0.05);
  EXPECT_EQ(json["kernel"], "gaussian:alpha=0.3");
  EXPECT_EQ(json["noise"], "ch-sd:beta=0.5");
  EXPECT_FALSE(std::filesystem::exists("out/registration.png"));
}

TEST_F(ConfiguredProgram, PrefersTheCommandLineToTheFile) {
  write("run.toml", kToml);
  EXPECT_EQ(registered("register --steps 5 --config run.toml --noise none")["steps"], 5);
  EXPECT_EQ(registered("register --config run.toml --dt 0.5")["steps"], 2) << "dt excludes the file's steps";
  write("c.csv", "x,y\n0.5,0\n1,0\n0,1\n");
  EXPECT_EQ(registered("register c.csv --config run.toml")["original"][0][0], 0.5);
}

TEST_F(ConfiguredProgram, PrefersTheSectionToWhatStandsAboveAll) {
  write("run.toml", "steps = 7\nno-picture = true\n[register]\nsteps = 4\n");
  EXPECT_EQ(registered("register a.csv b.csv -o out --config run.toml")["steps"], 4);
}

TEST_F(ConfiguredProgram, LetsOneFileServeAllVerbs) {
  std::string sections;
  for (const std::string verb : {"register", "atlas", "warp", "simulate", "ensemble", "compare", "fokker-planck",
                                 "reproduce", "convert", "info"})
    sections += "[" + verb + "]\nverbose = false\n";
  write("all.toml", sections);
  EXPECT_EQ(run(words("register a.csv b.csv -o out --config all.toml --print-config")).exit_code, 0);
  EXPECT_EQ(run(words("warp a.json b.png -o c.png --config all.toml --print-config")).exit_code, 0);
}

TEST_F(ConfiguredProgram, KeepsWhatStandsInQuotes) {
  write("many.tps", "LM=3\n0 0\n1 0\n0 1\nID=ann\nLM=3\n0 0\n1.1 0\n0 1.1\nID=b \"b\n");
  write("run.toml",
        "source = \"many.tps#1\" # the first\ntarget = 'many.tps#id=b \"b'\nout = \"out\"\nno-picture=true\n");
  EXPECT_EQ(registered("register --config run.toml")["target"][1][0], 1.1);
}

TEST_F(ConfiguredProgram, TakesListsOverSeveralLines) {
  write("run.toml",
        "noise = [ # two\n  \"none\",\n\n  'p-sd:beta=1,fields=grid,count=2,width=0.5', # the second\n]\n"
        "shapes = [\"a.csv\", \"b.csv\"]\nout = \"out\"\nsigma = \"auto\"\n");
  const ProgramRun done = run(words("compare --config run.toml --print-config"));
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("noise = [\"none\", \"p-sd:beta=1,fields=grid,count=2,width=0.5\"]\n"));
  EXPECT_THAT(done.out, HasSubstr("shapes = [\"a.csv\", \"b.csv\"]\n"));
}

TEST_F(ConfiguredProgram, NamesTheLineOfWhatIsWrong) {
  EXPECT_THAT(complaint("run.toml", "\nstesp = 4\n"),
              HasSubstr("run.toml:2: unknown option 'stesp'; did you mean 'steps'"));
  EXPECT_THAT(complaint("run.toml", "[register]\nstesp = 4\n"), HasSubstr("run.toml:2: unknown option 'stesp'"));
  EXPECT_THAT(complaint("run.toml", "[regsiter]\n"),
              HasSubstr("run.toml:1: unknown verb 'regsiter'; did you mean 'register'"));
  EXPECT_THAT(complaint("run.toml", "steps = \"many\"\n"),
              HasSubstr("run.toml:1: steps is 'many'; a number is needed"));
  EXPECT_THAT(complaint("run.toml", "steps = [1, 2]\n"), HasSubstr("run.toml:1: steps must be one value, not a list"));
  EXPECT_THAT(complaint("run.toml", "steps = true\n"), HasSubstr("run.toml:1: steps is true; it needs a value"));
  EXPECT_THAT(complaint("run.toml", "reflect = \"yes\"\n"), HasSubstr("run.toml:1: reflect must be true or false"));
  EXPECT_THAT(complaint("run.toml", "mode = \"mapp\"\n"),
              HasSubstr("run.toml:1: unknown mode 'mapp'; did you mean 'map'"));
  EXPECT_THAT(complaint("run.toml", "threads = -1\n"), HasSubstr("run.toml:1: --threads is -1"));
  EXPECT_THAT(complaint("run.toml", "steps = 10\ndt = 0.1\n"), HasSubstr("--steps"));
  EXPECT_THAT(complaint("run.toml", "config = \"other.toml\"\n"),
              HasSubstr("run.toml:1: 'config' belongs on the command line"));
  EXPECT_THAT(complaint("run.toml", "kernel = \"\"\n"), HasSubstr("run.toml:1: kernel is empty"));
  EXPECT_THAT(complaint("run.toml", "target = [\"b.csv\", \" \"]\n"), HasSubstr("run.toml:1: target is empty"));
  EXPECT_THAT(complaint("run.toml", "json = \"a\\u0000b\"\n"), HasSubstr("run.toml:1: json holds a zero byte"));
}

TEST_F(ConfiguredProgram, NamesTheLineOfWhatIsNoToml) {
  EXPECT_THAT(complaint("run.toml", "kernel = gaussian\n"),
              AllOf(HasSubstr("run.toml:1: error while parsing value"), HasSubstr("strings need quotes")));
  EXPECT_THAT(complaint("run.toml", "\n\nkernel = \"gaussian\n"), HasSubstr("run.toml:3: error while parsing string"));
  EXPECT_THAT(complaint("run.toml", "kernel = \"a\\qb\"\n"), HasSubstr("run.toml:1: error while parsing string"));
  EXPECT_THAT(complaint("run.toml", "steps 4\n"), HasSubstr("run.toml:1: error while parsing key-value pair"));
  EXPECT_THAT(complaint("run.toml", "steps = 4 5\n"), HasSubstr("run.toml:1: error while parsing key-value pair"));
  EXPECT_THAT(complaint("run.toml", "steps = 4\nsteps = 5\n"), HasSubstr("run.toml:2: error while parsing key-value"));
  EXPECT_THAT(complaint("run.toml", "fit = [\"beta\"\n"), HasSubstr("run.toml:1: error while parsing array"));
  EXPECT_THAT(complaint("run.toml", "[register\n"), HasSubstr("run.toml:1: error while parsing table header"));
  EXPECT_THAT(complaint("run.toml", "[a]\n[a]\n"), HasSubstr("run.toml:2: error while parsing table header"));
  EXPECT_THAT(complaint("run.toml", "= 4\n"), HasSubstr("run.toml:1: error while parsing"));
  EXPECT_THAT(complaint("run.toml", "kernel = \"\xFF\"\n"), HasSubstr("run.toml:1: "));
  for (const char* not_used : {"[[register]]\n", "[register.more]\n", "steps = 2020-01-02\n", "fit = [[\"beta\"]]\n"})
    EXPECT_THAT(complaint("run.toml", not_used),
                HasSubstr("run.toml:1: a string, number, true, false or list of these"));
  for (const char* other : {"run.json", "run.ini"})
    EXPECT_THAT(complaint(other, "steps = 4\n"), HasSubstr("a .toml file is needed"));
  EXPECT_THAT(complaint("a.csv", "x,y\n0,0\n1,0\n0,1\n", "--config none.toml"), HasSubstr("--config"));
  const ProgramRun missing = run(words("register a.csv b.csv -o out --config none.toml"));
  EXPECT_EQ(missing.exit_code, 2);
  EXPECT_THAT(missing.err, HasSubstr("'none.toml'"));
}

std::string repeated(const std::string& text, int count) {
  std::string all;
  for (int i = 0; i < count; ++i) all += text;
  return all;
}

TEST_F(ConfiguredProgram, EndsWellWhereAFileIsDeepOrLong) {
  const std::string deep = repeated("a.", 35'000) + "a";
  EXPECT_THAT(complaint("run.toml", "\n[" + deep + "]\n"), HasSubstr("run.toml:2: a key has more than 16 parts"));
  EXPECT_THAT(complaint("run.toml", deep + " = 1\n"), HasSubstr("run.toml:1: a key has more than 16 parts"));
  EXPECT_THAT(complaint("run.toml", repeated("\"a\" . ", 35'000) + "a = 1\n"), HasSubstr("more than 16 parts"));
  EXPECT_THAT(complaint("run.toml", "x = {" + deep + " = 1}\n"), HasSubstr("more than 16 parts"));
  EXPECT_THAT(complaint("run.toml", "x = " + std::string(100'000, '[')), HasSubstr("run.toml:1: "));
  EXPECT_THAT(complaint("run.toml", "x = " + repeated("{a=", 100'000)), HasSubstr("run.toml:1: "));
  EXPECT_THAT(complaint("run.toml", repeated("[[a]]\n", 100'000)), HasSubstr("run.toml:1: "));
  EXPECT_THAT(complaint("run.toml", std::string((1 << 20) + 1, '#')), HasSubstr("it holds more than 1 MiB"));
}

TEST_F(ConfiguredProgram, TakesDotsInTextForNoDepth) {
  const std::string dots = repeated("../", 40) + "a.b.c.d.e.f.g.h.i.j.k.l.m.n.o.p.q.r.s.t";
  write("run.toml", "# " + dots + "\n[merge]\npart = \"" + dots + "\"\n[convert]\nfiles = '''" + dots +
                        "\n'''\n[register]\nsteps = 10 # it's " + dots + "\n");
  EXPECT_EQ(registered("register a.csv b.csv -o out --no-picture --config run.toml")["steps"], 10);
}

// What is printed makes the same run, and prints the same again.
TEST_F(ConfiguredProgram, PrintsAConfigurationThatRepeatsTheRun) {
  const std::string options = "register a.csv b.csv -o out --no-picture --kernel gaussian:alpha=0.4 --dt 0.1 --seed 7";
  const ProgramRun printed = run(words(options + " --print-config"));
  EXPECT_EQ(printed.exit_code, 0) << printed.err;
  EXPECT_FALSE(std::filesystem::exists("out")) << "nothing is run";
  EXPECT_THAT(printed.out, HasSubstr("[register]\n"));
  EXPECT_THAT(printed.out, HasSubstr("source = \"a.csv\"\n"));
  EXPECT_THAT(printed.out, HasSubstr("dt = 0.1\n"));
  EXPECT_THAT(printed.out, HasSubstr("seed = 7\n"));
  EXPECT_THAT(printed.out, HasSubstr("no-picture = true\n"));
  EXPECT_THAT(printed.out, HasSubstr("sigma = \"0.5%\"\n")) << "defaults as well";
  EXPECT_THAT(printed.out, Not(HasSubstr("steps")));
  write("run.toml", printed.out);
  EXPECT_EQ(run(words("register --config run.toml --print-config")).out, printed.out);
  nlohmann::json first = registered(options);
  nlohmann::json second = registered("register --config run.toml");
  first.erase("seconds");
  second.erase("seconds");
  EXPECT_EQ(first, second);
}

TEST_F(ConfiguredProgram, TakesASectionOfEveryVerb) {
  const std::string help = run({"--help"}).out;
  std::string sections;
  for (const std::string verb : {"register", "atlas", "audit", "warp", "simulate", "ensemble", "merge", "compare",
                                 "sample", "fokker-planck", "reproduce", "view", "convert", "info", "completion"}) {
    EXPECT_THAT(help, HasSubstr("\n  " + verb + ' '));
    sections += "[" + verb + "]\n";
  }
  write("all.toml", sections);
  const ProgramRun done = run(words("register a.csv b.csv -o out --config all.toml --print-config"));
  EXPECT_EQ(done.exit_code, 0) << done.err;
}

TEST_F(ConfiguredProgram, PrintsTheConfigurationOfEveryVerb) {
  for (const std::string line :
       {"warp r.json a.png -o b.png --no-flip-y --size 10x20", "simulate --q 0,1 -o out",
        "ensemble --q 0,1 -o out --densities 1,2", "compare a.csv b.csv -o out", "fokker-planck --q 0,1 -o out",
        "reproduce figure1 -o out", "register a.csv b.csv -o out", "sample a.csv b.csv -o out", "convert a.csv b.csv",
        "info a.csv --all"}) {
    const ProgramRun printed = run(words(line + " --print-config"));
    EXPECT_EQ(printed.exit_code, 0) << line << printed.err;
    EXPECT_THAT(printed.out, Not(testing::ContainsRegex("= \"[0-9]+\"\n")));
    write("run.toml", printed.out);
    const ProgramRun again = run(words(line.substr(0, line.find(' ')) + " --config run.toml --print-config"));
    EXPECT_EQ(again.out, printed.out) << again.err;
  }
}

}  // namespace
}  // namespace pulson
