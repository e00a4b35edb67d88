// Paths that are no files, outputs that are inputs or each other, and values that are empty.

#include <regex>

#include <gmock/gmock.h>
#include <sys/stat.h>

#include "shell_commands.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

class PathsOfProgram : public ShellCommands {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("a.csv", "x,y\n0,0\n1,0\n0,1\n");
    write("b.csv", "x,y\n0,0\n1.1,0\n0,1.2\n");
    write("c.tps", "LM=3\n0 0\n1 0\n0 1\nID=one\nLM=3\n0 0\n1 0\n0 1.2\nID=two\nLM=3\n0 0\n1.1 0\n0 1\nID=three\n");
    write("solid.csv", "x,y,z\n0,0,0\n1,0,0\n0,1,0\n0,0,1\n");
    write("image.png", contents((fs::path(PULSON_SOURCE_DIR) / "sample_shapes" / "leaf_1.png").string()));
  }

  /// One line on standard error within seconds, and nothing written.
  static std::string refusal(const Arguments& arguments) {
    const auto before = all_files();
    const ProgramRun done = run(arguments, {.limit = 30});
    const std::string line = testing::PrintToString(arguments);
    EXPECT_EQ(done.exit_code, 2) << line << done.err;
    EXPECT_EQ(done.out, "") << line;
    EXPECT_EQ(count_lines(done.err), 1U) << line << done.err;
    EXPECT_THAT(done.err, StartsWith("pulson: ")) << line;
    EXPECT_TRUE(changed_since(before).empty()) << line;
    return done.err;
  }

  static void register_pair() { ASSERT_EQ(run(words("register a.csv b.csv -o fit --no-picture")).exit_code, 0); }

  static std::vector<std::string> verbs() {
    std::vector<std::string> names;
    const std::string help = run({"--help"}).out;
    std::istringstream lines(help.substr(help.find("\nVerbs:\n") + 8));
    for (std::string line; std::getline(lines, line) && line.starts_with("  ");)
      if (line[2] != ' ') names.push_back(line.substr(2, line.find(' ', 2) - 2));
    return names;
  }

  struct HelpOption {
    std::string name;
    std::string type;
  };

  /// The options of a verb that take a value.
  static std::vector<HelpOption> options_of(const std::string& verb) {
    static const std::regex kOption(R"(^  (?:-\w,)?(--[\w-]+) ([A-Za-z/:=.,]+)( .*)?$)");
    std::vector<HelpOption> options;
    std::istringstream lines(run({verb, "--help-all"}).out);
    for (std::string line; std::getline(lines, line);)
      if (std::smatch match; std::regex_match(line, match, kOption)) options.push_back({match[1], match[2]});
    return options;
  }
};

TEST_F(PathsOfProgram, OfAnyKindAreRefusedInALine) {
  fs::create_directory("folder");
  fs::create_symlink("loop", "loop");
  fs::create_symlink("missing", "dangling");
  ASSERT_EQ(::mkfifo("pipe", 0600), 0);
  const std::string long_name(300, 'n'), longer_name(5000, 'n');
  for (const std::string& path :
       {std::string("folder"), std::string("loop"), std::string("dangling"), std::string("pipe"), long_name,
        longer_name, std::string("/dev/zero"), std::string("/dev/urandom"), std::string("a.csv/below"),
        std::string("/"), std::string("."), std::string("loop#1"), long_name + "#1", std::string("/dev/null")}) {
    EXPECT_LT(refusal({"info", path}).size(), 400U);
    refusal({"convert", path, "out.tps"});
    refusal({"register", path, "b.csv", "-o", "out"});
    refusal({"warp", path, "a.csv", "-o", "out.csv"});
  }
  for (const char* word : {"-", "--", "---", "", " ", "-x", "--x"}) refusal({word});
  for (const char* word : {"--", "", " "}) refusal({"info", word});
  EXPECT_EQ(bash("$P info - < /dev/null").exit_code, 2);
}

TEST_F(PathsOfProgram, WithoutPermissionAreRefusedInALine) {
  if (::geteuid() == 0) GTEST_SKIP() << "root may read everything";
  fs::permissions("a.csv", fs::perms::none);
  EXPECT_THAT(refusal({"info", "a.csv"}), HasSubstr("Permission denied"));
  fs::create_directory("folder");
  fs::permissions("folder", fs::perms::none);
  EXPECT_THAT(refusal({"info", "folder/a.csv"}), HasSubstr("permissions"));
  fs::permissions("folder", fs::perms::all);
}

// Wherever data are read.
TEST_F(PathsOfProgram, WithoutAnEndAreNotRead) {
  register_pair();
  ASSERT_EQ(::mkfifo("pipe", 0600), 0);
  for (const char* name : {"e.toml", "e.png", "e.ply", "e.mha", "e.npy", "e.json", "e.tps", "e.nwk"})
    fs::create_symlink("/dev/zero", name);
  fs::create_directory("out");
  for (const char* line : {"register a.csv b.csv -o out --weights pipe",
                           "register a.csv b.csv -o out --covariances /dev/zero",
                           "register a.csv b.csv -o out --image e.png",
                           "register a.csv b.csv -o out --image pipe",
                           "register a.csv b.csv -o out --template pipe",
                           "register solid.csv solid.csv -o out --mesh e.ply",
                           "register a.csv b.csv -o out --config e.toml",
                           "register a.csv pipe -o out",
                           "register a.csv /dev/urandom -o out",
                           "atlas pipe -o out",
                           "atlas c.tps -o out --covariate pipe:x",
                           "atlas c.tps -o out --groups /dev/zero:x",
                           "atlas c.tps -o out --model x --data pipe",
                           "simulate --shape pipe -o out",
                           "simulate --from pipe -o out",
                           "simulate --from e.json -o out",
                           "simulate --shape a.csv --momenta pipe -o out",
                           "ensemble --from /dev/zero -o out",
                           "ensemble --shape e.tps -o out",
                           "sample a.csv pipe -o out",
                           "sample a.csv b.csv --tree e.nwk -o out",
                           "compare pipe a.csv -o out",
                           "compare a.csv b.csv --source pipe -o out",
                           "merge pipe -o out",
                           "merge /dev/zero -o out",
                           "warp pipe a.csv -o x.csv",
                           "warp e.json image.png -o x.png",
                           "warp fit e.png -o x.png",
                           "warp fit e.mha -o x.mha",
                           "warp fit pipe -o x.csv",
                           "warp fit image.png --like e.png -o x.png",
                           "convert pipe x.csv",
                           "convert e.npy x.csv",
                           "info pipe"})
    refusal(words(line));
  for (const char* checkpoint : {"ensemble.partial", "atlas.partial", "sample.partial", "register.partial"})
    ASSERT_EQ(::mkfifo((std::string("out/") + checkpoint).c_str(), 0600), 0);
  for (const char* line : {"ensemble --q 0,1 -o out --resume --no-picture", "atlas c.tps -o out --resume --no-picture",
                           "register c.tps -o out --resume --no-picture"})
    refusal(words(line));
}

TEST_F(PathsOfProgram, OfOwnPipesAreRead) {
  EXPECT_EQ(bash("cat a.csv | $P info -").exit_code, 0);
  EXPECT_EQ(bash("$P info /dev/stdin < a.csv").exit_code, 0);
  EXPECT_EQ(bash("$P info <(cat a.csv)").exit_code, 0);
  const ProgramRun both = bash("$P register <(cat a.csv) <(cat b.csv) -o out --no-picture");
  EXPECT_EQ(both.exit_code, 0) << both.err;
  for (const char* endless : {"yes 1,2 | $P info -", "$P info <(yes 1,2)", "$P info - < /dev/zero"}) {
    const ProgramRun done = bash(endless);
    EXPECT_EQ(done.exit_code, 2) << endless;
    EXPECT_THAT(done.err, HasSubstr("holds more than 256 MiB")) << endless;
  }
}

TEST_F(PathsOfProgram, DeepRecordsAreRefusedInALine) {
  std::string objects;
  for (int i = 0; i < 1'000'000; ++i) objects += "{\"a\":";
  write("arrays.json", std::string(1'000'000, '['));
  write("closed.json", std::string(1'000'000, '[') + std::string(1'000'000, ']'));
  write("objects.json", objects);
  for (const char* file : {"arrays.json", "closed.json", "objects.json"}) {
    for (const Arguments& line : {Arguments{"info", file}, Arguments{"simulate", "--from", file, "-o", "out"},
                                  Arguments{"warp", file, "a.csv", "-o", "x.csv"}}) {
      const ProgramRun done = run(line);
      EXPECT_EQ(done.exit_code, 2) << file << line.front();
      EXPECT_EQ(count_lines(done.err), 1U) << done.err;
    }
  }
}

TEST_F(PathsOfProgram, OfOutputsAreNoInputs) {
  register_pair();
  fs::create_symlink("a.csv", "link.csv");
  fs::create_hard_link("a.csv", "hard.csv");
  fs::create_directory("out");
  for (const char* name : {"registration.json", "ensemble.json", "comparison.json"})
    fs::copy("a.csv", std::string("out/") + name);
  fs::copy("c.tps", "out/cohort.json");
  fs::copy("c.tps", "out/atlas.json");
  fs::copy("fit/registration.json", "out/paths.csv");
  write("image.tps", "LM=3\n0 0\n1 0\n0 1\nIMAGE=out/registration.png\nLM=3\n0 0\n1 0\n0 1.2\n");
  fs::copy("image.png", "out/registration.png");
  write("run.toml", "json = \"./a.csv\"\n");
  for (const char* line : {"register a.csv b.csv -o new --json a.csv",
                           "register a.csv b.csv -o new --json ./b.csv",
                           "register link.csv b.csv -o new --json a.csv",
                           "register a.csv b.csv -o new --json hard.csv",
                           "register a.csv b.csv -o new --config run.toml",
                           "register a.csv b.csv -o new --config run.toml --json run.toml",
                           "register out/registration.json b.csv --format csv -o out",
                           "register c.tps#1 out/cohort.json -o out",
                           "register image.tps#1 image.tps#2 -o out",
                           "register a.csv b.csv --weights w.csv -o new --json w.csv",
                           "atlas c.tps -o new --json c.tps",
                           "atlas out/atlas.json --format tps -o out",
                           "compare a.csv b.csv -o new --json b.csv",
                           "compare out/comparison.json b.csv --format csv -o out",
                           "sample a.csv b.csv -o new --json a.csv",
                           "simulate --shape c.tps#1 -o new --json c.tps",
                           "simulate --from fit/registration.json -o new --json fit/registration.json",
                           "simulate --from out/paths.csv -o out",
                           "ensemble --shape a.csv -o new --save-final a.csv",
                           "ensemble --shape a.csv -o new --save-paths link.csv",
                           "ensemble --shape out/ensemble.json --format csv -o out",
                           "merge out/ensemble.json -o out",
                           "merge a.csv -o new --json a.csv",
                           "warp fit image.png -o image.png",
                           "warp fit image.png -o x.png --json fit/registration.json",
                           "warp fit image.png -o x.png --report ./image.png",
                           "warp fit b.csv -o b.csv",
                           "convert a.csv a.csv",
                           "convert a.csv link.csv",
                           "convert c.tps#1 c.tps",
                           "convert a.csv b.csv -o hard.csv",
                           "convert c.tps ./c.tps --to csv",
                           "info a.csv --json a.csv",
                           "info c.tps#2 --json c.tps"}) {
    if (!fs::exists("w.csv")) write("w.csv", "1\n1\n1\n");
    EXPECT_THAT(refusal(words(line)), HasSubstr("which is an input")) << line;
  }
}

TEST_F(PathsOfProgram, OfOutputsAreNotBehindStandardInput) {
  const ProgramRun done = bash("$P info - --json a.csv < a.csv");
  EXPECT_EQ(done.exit_code, 2);
  EXPECT_THAT(done.err, HasSubstr("which is an input"));
  EXPECT_THAT(contents("a.csv"), StartsWith("x,y\n"));
}

TEST_F(PathsOfProgram, OfTwoOutputsDiffer) {
  register_pair();
  write("old.png", "old");
  fs::create_symlink("old.png", "link.png");
  fs::create_symlink("new.png", "dangling.png");
  fs::create_directories("out/two");
  for (const char* line : {"warp fit image.png -o same.png --report same.png",
                           "warp fit image.png -o same.png --report ./same.png",
                           "warp fit image.png -o old.png --grid link.png",
                           "warp fit image.png -o new.png --grid dangling.png",
                           "warp fit image.png -o x.png --grid y.png --holes y.png",
                           "warp fit image.png -o x.png --json x.png",
                           "register a.csv b.csv -o out --json out/registration.json",
                           "register a.csv b.csv -o out --json out/report.html",
                           "register c.tps -o out --json out/cohort.json",
                           "register c.tps -o out --json out/two/registration.json",
                           "register a.csv b.csv -o new --json new",
                           "atlas c.tps -o out --json out/atlas.partial",
                           "ensemble --q 0,1 -o out --save-final s.npy --save-paths s.npy",
                           "ensemble --q 0,1 -o out --save-final out/ensemble.json",
                           "ensemble --q 0,1 -o out --save-final s.npy --json s.npy",
                           "simulate --q 0,1 -o out --json out/paths.csv",
                           "fokker-planck --q 0,1 --p 1,0 -o out --json out/report.html",
                           "compare a.csv b.csv -o out --json out/models.csv",
                           "sample a.csv b.csv -o out --json out/summary.json",
                           "sample a.csv b.csv -o out --json out/sample.partial",
                           "ensemble --q 0,1 -o out --json out/ensemble.partial"})
    EXPECT_THAT(refusal(words(line)), HasSubstr("would both write")) << line;
  EXPECT_EQ(run(words("warp fit image.png -o /dev/null --json /dev/null")).exit_code, 2) << "it has no extension";
  EXPECT_EQ(
      run(words("ensemble --q 0,1 --samples 2 --time 1 -o new --no-picture --json /dev/null --save-final /dev/null"))
          .exit_code,
      0);
}

// Each option of files of each verb is known as one of the two: a new one fails here.
TEST_F(PathsOfProgram, AreEitherReadOrWritten) {
  register_pair();
  const std::map<std::string, std::string> smallest = {{"register", "register a.csv b.csv -o new --steps 0"},
                                                       {"atlas", "atlas a.csv b.csv -o new --steps 0"},
                                                       {"audit", "audit a.csv b.csv -o new"},
                                                       {"warp", "warp fit a.csv --size 0x0 -o new.csv"},
                                                       {"simulate", "simulate --shape a.csv --steps 0 -o new"},
                                                       {"ensemble", "ensemble --shape a.csv --steps 0 -o new"},
                                                       {"merge", "merge a.csv -o new"},
                                                       {"compare", "compare a.csv b.csv --steps 0 -o new"},
                                                       {"sample", "sample a.csv b.csv --steps 0 -o new"},
                                                       {"fokker-planck", "fokker-planck --grids 0 -o new"},
                                                       {"reproduce", "reproduce nothing -o new"},
                                                       {"convert", "convert a.csv"},
                                                       {"view", "view a.csv --no-browser"},
                                                       {"info", "info a.csv"},
                                                       {"completion", "completion bash"}};
  const std::set<std::string> inputs = {"--config", "--weights",  "--covariances", "--image", "--mesh",
                                        "--tree",   "--from",     "--like",        "--links", "--shape",
                                        "--source", "--template", "--momenta",     "--data"};
  for (const std::string& verb : verbs()) {
    ASSERT_TRUE(smallest.contains(verb)) << verb;
    for (const HelpOption& option : options_of(verb)) {
      if (option.type != "FILE" || inputs.contains(option.name) || option.name == "--out") continue;
      if (verb == "fokker-planck") continue;  // which has no input
      EXPECT_THAT(refusal(joined(words(smallest.at(verb)), {option.name, "a.csv"})), HasSubstr("which is an input"))
          << verb << option.name;
    }
  }
}

TEST_F(PathsOfProgram, OfLinksKeepTheLinks) {
  register_pair();
  fs::create_directory("folder");
  fs::create_symlink("folder/real.png", "link.png");
  fs::create_symlink("link.png", "second.png");
  fs::create_symlink("real.json", "link.json");
  EXPECT_EQ(run(words("warp fit image.png -o second.png --pixel-size 1 --json link.json")).exit_code, 0);
  EXPECT_TRUE(fs::is_symlink("second.png") && fs::is_symlink("link.png") && fs::is_symlink("link.json"));
  EXPECT_EQ(contents("folder/real.png").substr(1, 3), "PNG");
  EXPECT_FALSE(read_json("real.json").is_discarded());
  fs::create_symlink("no/real.png", "nowhere.png");
  fs::create_symlink("nowhere.png", "nowhere_2.png");
  EXPECT_THAT(refusal(words("warp fit image.png -o nowhere_2.png")), HasSubstr("there is no folder 'no'"));
  EXPECT_THAT(refusal(words("register a.csv b.csv -o nowhere.png")), HasSubstr("which is missing"));
  EXPECT_TRUE(fs::is_symlink("nowhere.png"));
}

TEST_F(PathsOfProgram, AreNeverEmpty) {
  std::size_t count = 0;
  for (const std::string& verb : verbs()) {
    for (const HelpOption& option : options_of(verb)) {
      ++count;
      const std::string expected = "pulson: " + option.name + " is empty; give it a value or leave it out";
      EXPECT_THAT(refusal({verb, option.name, ""}), StartsWith(expected)) << verb;
      EXPECT_THAT(refusal({verb, option.name + "="}), StartsWith(expected)) << verb;
    }
    EXPECT_THAT(refusal({verb, ""}), HasSubstr("argument 1 of " + verb + " is empty"));
  }
  EXPECT_GT(count, 150U) << "the help is not understood";
  EXPECT_THAT(refusal({"register", "a.csv", "b.csv", "-o", ""}), StartsWith("pulson: -o is empty"));
  EXPECT_THAT(refusal({"register", "a.csv", "", "-o", "out"}), HasSubstr("argument 2 of register is empty"));
  EXPECT_THAT(refusal({"register", "--", "a.csv", ""}), HasSubstr("argument 3 of register is empty"));
}

}  // namespace
}  // namespace pulson
