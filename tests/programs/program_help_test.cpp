// What the program says of itself, and of a file.

#include <algorithm>
#include <set>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "matching/defaults.hpp"
#include "program.hpp"
#include "pulson/formats/landmark_files.hpp"
#include "pulson/integrators/integrator.hpp"
#include "pulson/kernels/kernel_operator.hpp"
#include "pulson/noise/noise_table.hpp"

namespace pulson {
namespace {

namespace fs = std::filesystem;
using testing::HasSubstr;
using testing::MatchesRegex;

class HelpOfProgram : public Program {
 protected:
  static std::string printed(const Arguments& arguments) {
    const ProgramRun done = run(arguments);
    EXPECT_EQ(done.exit_code, 0);
    EXPECT_EQ(done.err, "");
    return done.out;
  }
};

template <class Make>
void expect_rows(const NameTable<Make>& table, const std::string& text) {
  EXPECT_FALSE(table.rows().empty());
  for (const auto& row : table.rows()) {
    EXPECT_THAT(text, HasSubstr(row.name + " "));
    EXPECT_THAT(text, HasSubstr(row.help));
    for (const ParameterInfo& parameter : row.parameters) EXPECT_THAT(text, HasSubstr(parameter.help));
  }
}

TEST_F(HelpOfProgram, ListsTheVerbs) {
  const std::string text = printed({"--help"});
  EXPECT_THAT(text, HasSubstr("register"));
  EXPECT_THAT(text, HasSubstr("info"));
  EXPECT_EQ(printed({"-h"}), text);
  EXPECT_EQ(printed({"help"}), text);
  for (const std::string verb : {"register", "atlas", "warp"})
    EXPECT_EQ(printed({"help", verb}), printed({verb, "--help"}));
}

TEST_F(HelpOfProgram, GivesAnExampleForEachVerb) {
  EXPECT_THAT(printed({"register", "--help"}), HasSubstr("pulson register a.csv b.csv -o out"));
  EXPECT_THAT(printed({"register", "--help"}), HasSubstr("Exit codes"));
  EXPECT_THAT(printed({"info", "--help"}), HasSubstr("pulson info noises"));
  for (const std::string verb : {"register", "atlas", "audit", "warp", "simulate", "ensemble", "compare",
                                 "fokker-planck", "reproduce", "view", "convert", "info", "completion"}) {
    const std::string help = printed({verb, "--help"});
    EXPECT_THAT(help, HasSubstr("\n  pulson " + verb + " ")) << verb;
    EXPECT_THAT(help, HasSubstr("\nExit codes: 0 done")) << verb;
    EXPECT_THAT(help, testing::Not(HasSubstr("TEXT"))) << verb;
  }
}

TEST_F(HelpOfProgram, KnowsItsVersion) {
  const std::string text = printed({"--version"});
  EXPECT_EQ(printed({"-v"}), text);
  EXPECT_THAT(text.substr(0, text.find('\n')), MatchesRegex("pulson [0-9]+\\.[0-9]+\\.[0-9]+"));
  EXPECT_LT(std::count(text.begin(), text.end(), '\n'), 15);
  for (const std::string library : {"Eigen", "Highway", "NLopt", "Ceres", "Qhull", "zlib", "fmt", "nlohmann_json",
                                    "CLI11", R"(toml\+\+)", "OpenCV", "OpenBLAS"})
    EXPECT_THAT(text, testing::ContainsRegex(library + " [0-9]+\\.[0-9]+"));
}

TEST_F(HelpOfProgram, PrintsTheTables) {
  expect_rows(kernel_table(), printed({"info", "kernels"}));
  expect_rows(noise_table(), printed({"info", "noises"}));
  expect_rows(integrator_table(), printed({"info", "integrators"}));
  const std::string formats = printed({"info", "formats"});
  for (const formats::LandmarkFormat& format : formats::landmark_formats()) {
    EXPECT_THAT(formats, HasSubstr(format.name + " "));
    EXPECT_THAT(formats, HasSubstr(format.help));
    for (const std::string& extension : format.extensions) EXPECT_THAT(formats, HasSubstr("." + extension));
  }
  EXPECT_EQ(static_cast<std::size_t>(std::count(formats.begin(), formats.end(), '\n')),
            formats::landmark_formats().size());
  EXPECT_THAT(formats, HasSubstr("\nbigwarp       read, written  .bigwarp.csv    landmarks of"));
  EXPECT_THAT(formats, HasSubstr("\ncsv           read, written  .csv .tsv       table"));
}

TEST_F(HelpOfProgram, PrintsTheDefaultsThatVerbsUse) {
  const std::string text = printed({"info", "defaults"});
  const nlohmann::json record = nlohmann::json::parse(printed({"info", "defaults", "--json", "-"}))["defaults"];
  ASSERT_EQ(record.size(), matching::default_table().size());
  for (std::size_t i = 0; i < record.size(); ++i) {
    const matching::TaskDefaults& task = matching::default_table()[i];
    EXPECT_EQ(record[i]["task"], task.task);
    EXPECT_EQ(record[i]["kernel"]["value"], task.kernel.value);
    EXPECT_THAT(text, HasSubstr(task.task + '\n'));
    EXPECT_THAT(text, HasSubstr(task.integrator.reason));
  }
  EXPECT_TRUE(record.back()["sigma"].is_null());
  for (const auto& [verb, task] : {std::pair{"register", matching::register_defaults()},
                                   {"compare", matching::compare_defaults()},
                                   {"atlas", matching::atlas_defaults()}}) {
    const std::string help = printed({verb, "--help-all"});
    for (const std::string& value : {task.kernel.value, task.sigma.value, task.lambda.value})
      EXPECT_THAT(help, HasSubstr("[" + value + "]")) << verb;
  }
}

TEST_F(HelpOfProgram, HasTheUsualOptionsInGroupsAndAllOnDemand) {
  const auto options_in = [](const std::string& help) {
    std::set<std::string> names;
    for (std::size_t at = 0; (at = help.find("\n  -", at)) != std::string::npos; ++at)
      names.insert(help.substr(at + 3, help.find_first_of(" \n", at + 3) - at - 3));
    return names;
  };
  constexpr std::size_t kUsual = 24;  // with -h and --help-all
  for (const std::string verb : {"register", "compare", "sample", "atlas", "simulate", "ensemble", "warp"}) {
    const std::string usual = printed({verb, "--help"}), all = printed({verb, "--help-all"});
    const std::set<std::string> few = options_in(usual), many = options_in(all);
    EXPECT_LE(few.size(), kUsual) << verb;
    EXPECT_GT(many.size(), few.size()) << verb;
    EXPECT_TRUE(std::includes(many.begin(), many.end(), few.begin(), few.end())) << verb;
    EXPECT_THAT(usual, testing::Not(HasSubstr(", more:"))) << verb;
    EXPECT_TRUE(few.contains("-o,--out") && many.contains("--config")) << verb;
  }
  EXPECT_THAT(printed({"register", "--help"}), HasSubstr("\nModel:\n"));
  EXPECT_THAT(printed({"register", "--help-all"}), HasSubstr("\nModel, more:\n"));
}

TEST_F(HelpOfProgram, TellsWhatIsInAFile) {
  const std::string discs = printed({"info", sample("discs_source")});
  EXPECT_THAT(discs, HasSubstr("34 landmarks in 2D"));
  EXPECT_THAT(discs, HasSubstr("2 groups"));
  EXPECT_THAT(printed({"info", sample("swap_source")}), HasSubstr("2 landmarks in 1D"));
  write("pair.tps", "LM=2\n0 0\n1 0\nID=ann\nLM=2\n0 0\n0 0\nID=bob\n");
  const std::string pair = printed({"info", "pair.tps"});
  EXPECT_THAT(pair, HasSubstr("2 shapes"));
  EXPECT_THAT(pair, HasSubstr("ann"));
  EXPECT_THAT(pair, HasSubstr("1 and 2 coincide"));
}

TEST_F(HelpOfProgram, TellsWhatIsInSeveralFiles) {
  write("pair.tps", "LM=2\n0 1\n1 0\nID=ann\nLM=2\n2 1\n1 1\nID=bob\n");
  write("line.csv", "x\n0\nNA\n2\n");
  EXPECT_EQ(printed({"info", "pair.tps", "line.csv"}),
            "pair.tps  2 shapes, landmarks 2 in 2D\n"
            "line.csv  1 shape, landmarks 3 in 1D, 1 missing\n");
  const nlohmann::json json = nlohmann::json::parse(printed({"info", "pair.tps", "line.csv", "--json", "-"}));
  EXPECT_EQ(json["files"][1]["shapes"][0]["missing"], 1);
  EXPECT_THAT(run({"info", "pair.tps", "kernels"}).err, HasSubstr("'kernels' is a table, to be asked for alone"));
}

// A full disk behind `> FILE` must not look like success.
TEST_F(HelpOfProgram, FailsWhereItsOutputIsLost) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "there is no /dev/full";
  const Arguments swap = words("--noise ch-sd:beta=2 --no-picture --json - -o out");
  const std::vector<Arguments> commands = {
      {"info", "kernels"}, {"--help"}, joined({"register", sample("swap_source"), sample("swap_target")}, swap)};
  for (const Arguments& command : commands) {
    const ProgramRun done = run(command, {.out_path = "/dev/full"});
    EXPECT_NE(done.exit_code, 0) << command.front();
    EXPECT_EQ(count_lines(done.err), 1U) << command.front();
  }
}

}  // namespace
}  // namespace pulson
