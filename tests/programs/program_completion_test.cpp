// The script for bash, tried in bash.

#include <gmock/gmock.h>

#include "program.hpp"
#include "pulson/kernels/kernel_operator.hpp"

namespace pulson {
namespace {

using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsSupersetOf;
using testing::Not;

bool has_bash() { return std::system("command -v bash > /dev/null 2>&1") == 0; }

class CompletingProgram : public Program {
 protected:
  static void write_script(const std::string& file) {
    const ProgramRun done = run({"completion", "bash"});
    EXPECT_EQ(done.exit_code, 0) << done.err;
    EXPECT_EQ(done.err, "");
    write(file, done.out);
  }

  /// The lines that a shell prints.
  static std::vector<std::string> lines_of(const std::string& command) {
    EXPECT_EQ(std::system((command + " > lines 2> errors").c_str()), 0) << contents("errors");
    EXPECT_EQ(contents("errors"), "");
    std::vector<std::string> lines;
    std::istringstream stream(contents("lines"));
    for (std::string line; std::getline(stream, line);) lines.push_back(line);
    return lines;
  }

  /// What bash offers for the last of `typed`.
  static std::vector<std::string> in_bash(const Arguments& typed) {
    write_script("script");
    std::string line;
    for (const std::string& word : typed) line += " '" + word + "'";
    write("try", "source ./script\nCOMP_WORDS=(pulson" + line + ")\nCOMP_CWORD=" + std::to_string(typed.size()) +
                     "\n_pulson\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n");
    return lines_of("bash try");
  }
};

TEST_F(CompletingProgram, IsAVerbAtTheEndOfTheList) {
  EXPECT_THAT(run({"--help"}).out, HasSubstr("completion"));
  const ProgramRun unknown = run({"completion", "zsh"});
  EXPECT_EQ(unknown.exit_code, 2);
  EXPECT_THAT(unknown.err, HasSubstr("unknown shell 'zsh'; completion is for bash"));
}

TEST_F(CompletingProgram, CompletesInBash) {
  if (!has_bash()) GTEST_SKIP() << "there is no bash";
  write_script("script");
  EXPECT_EQ(std::system("bash -n script"), 0);
  EXPECT_THAT(in_bash({"reg"}), ElementsAre("register"));
  EXPECT_THAT(in_bash({"co"}), ElementsAre("compare", "convert", "completion"));
  EXPECT_THAT(in_bash({"register", "--ker"}), ElementsAre("--kernel"));
  EXPECT_THAT(in_bash({"register", "--noise", "ch"}), IsSupersetOf({"ch-sd", "ch-sd-screened"}));
  EXPECT_THAT(in_bash({"register", "a.csv", "b.csv", "--solver", ""}),
              ElementsAre("auto", "paths", "shooting", "gauss-newton", "lbfgs"));
  EXPECT_THAT(in_bash({"register", "--mode", "=", "ma"}), ElementsAre("map")) << "as bash splits --mode=ma";
  EXPECT_THAT(in_bash({"warp", "r.json", "a.png", "--ani"}), ElementsAre("--animate"));
  EXPECT_THAT(in_bash({"warp", "--method", "p"}), ElementsAre("pull", "push"));
  EXPECT_THAT(in_bash({"sample", "--method", "p"}), ElementsAre("pcn"));
  EXPECT_THAT(in_bash({"info", "ker"}), ElementsAre("kernels"));
  EXPECT_THAT(in_bash({"reproduce", "figure"}), ElementsAre("figure1", "figure2", "figure3", "figure4"));
  EXPECT_THAT(in_bash({"register", "--kernel", ""}), testing::SizeIs(kernel_table().rows().size()));
  EXPECT_THAT(in_bash({"register", "a"}), ElementsAre("")) << "files are readline's";
}

// The words that bash offers are those that the verb takes.
TEST_F(CompletingProgram, OffersWhatIsTaken) {
  if (!has_bash()) GTEST_SKIP() << "there is no bash";
  write("a.csv", "x,y\n0,0\n1,0\n0,1\n");
  write("b.csv", "x,y\n0,0\n1.1,0\n0,1.2\n");
  const Arguments usual =
      words("register a.csv b.csv -o out --no-picture --max-iterations 1 --noise ch-sd:beta=1 --sigma 1");
  for (const std::string option : {"--mode", "--data", "--curve-ends", "--align", "--solver", "--integrator"}) {
    const std::vector<std::string> offered = in_bash({"register", option, ""});
    EXPECT_THAT(offered, Not(Contains("")));
    for (const std::string& value : offered) {
      const std::string message = run(joined(usual, {option, value})).err;
      EXPECT_THAT(message, Not(HasSubstr("unknown"))) << option << ' ' << value;
    }
  }
}

}  // namespace
}  // namespace pulson
