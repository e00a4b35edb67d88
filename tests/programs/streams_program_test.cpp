// The three standard streams, and what names do to a terminal.

#include <gmock/gmock.h>

#include "shell_commands.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::HasSubstr;
using testing::Not;

class Streams : public ShellCommands {
 protected:
  void SetUp() override {
    Program::SetUp();
    write("a.csv", "x,y\n0,0\n1,0\n0,1\n");
    write("b.csv", "x,y\n0,0\n1.1,0\n0,1.2\n");
  }

  /// A run with a summary and a note on standard error.
  static constexpr const char* kRegister = "$P register a.csv b.csv -o out --no-picture --verbose ";

  static void expect_results(const std::string& where) {
    EXPECT_FALSE(read_json("out/registration.json").is_discarded()) << where;
    EXPECT_THAT(contents("out/residuals.csv"), Not(HasSubstr("wrote"))) << where;
    EXPECT_THAT(contents("a.csv"), testing::StartsWith("x,y\n0,0\n")) << where;
    std::filesystem::remove_all("out");
  }
};

TEST_F(Streams, ThatAreClosedHarmNothing) {
  for (const char* closed : {"2>&-", ">&-", "<&-", ">&- 2>&-", "<&- >&- 2>&-"}) {
    EXPECT_EQ(bash(std::string(kRegister) + closed).exit_code, 0) << closed;
    expect_results(closed);
  }
  EXPECT_EQ(bash("$P info - <&-").exit_code, 2);
}

TEST_F(Streams, ThatAreFullLoseNoResults) {
  EXPECT_EQ(bash(std::string(kRegister) + "2>/dev/full").exit_code, 0);
  expect_results("stderr");
  const ProgramRun full = bash(std::string(kRegister) + "-q --json - >/dev/full");
  EXPECT_EQ(full.exit_code, 2);
  EXPECT_EQ(count_lines(full.err), 1U) << full.err;
  for (const char* line :
       {"register a.csv b.csv -o out --no-picture", "register a.csv b.csv -o out --no-picture --json -"}) {
    const ProgramRun done = bash("$P " + std::string(line) + " >/dev/full");
    EXPECT_EQ(done.exit_code, 2) << line;
    EXPECT_EQ(done.err, "pulson: standard output could not be written: No space left on device\n") << line;
    expect_results(line);
  }
}

TEST_F(Streams, WhoseReaderEndedLoseNoResults) {
  bash("(sleep 0.3; " + std::string(kRegister) + "2>err; echo $? >code) | true");
  EXPECT_EQ(contents("code"), "0\n");
  EXPECT_THAT(contents("err"), Not(HasSubstr("pulson: "))) << "it was head, or the like, that has enough";
  expect_results("pipe");
}

TEST_F(Streams, ThatAreClosedCannotHoldWhatIsAskedFor) {
  for (const char* line :
       {"completion bash", "info a.csv --json -", "register a.csv b.csv -o out --no-picture --json -"}) {
    const ProgramRun done = bash("$P " + std::string(line) + " >&-");
    EXPECT_EQ(done.exit_code, 2) << line;
    EXPECT_EQ(count_lines(done.err), 1U) << done.err;
  }
}

TEST_F(Streams, ShowNamesHarmlessly) {
  const std::string evil =
      "red\x1b[31m\x07 \xE2\x80\xAE"
      "txt.exe \xC2\x9B"
      "1m";
  write("evil.tps", "LM=3\n0 0\n1 0\n0 1\nIMAGE=" + evil + ".png\nID=" + evil + "\nLM=3\n0 0\n1 0\n0 2\nID=other\n");
  write("evil.csv", "name,x,y\n" + evil + ",0,0\nb,0,0\nc,1,0\n");
  write(evil, "x,y\n0,0\n1,0\n0,1\n");
  for (const Arguments& line : {Arguments{"info", "evil.tps"}, Arguments{"info", "evil.csv"}, Arguments{"info", evil},
                                Arguments{"info", evil + "no"}, Arguments{"info", "evil.tps#id=" + evil + "no"},
                                Arguments{evil}, Arguments{"--" + evil}, Arguments{"info", "--" + evil},
                                Arguments{"register", evil, "b.csv", "-o", "out", "--no-picture"},
                                Arguments{"register", "evil.tps#1", "evil.tps#2", "-o", "out2", "--no-picture"},
                                Arguments{"convert", "evil.tps", evil + ".csv"},
                                Arguments{"register", "a.csv", "b.csv", "-o", "out3", "--kernel", evil}}) {
    const ProgramRun done = run(line);
    EXPECT_THAT(done.out + done.err, AllOf(Not(HasSubstr("\x1b")), Not(HasSubstr("\x07")),
                                           Not(HasSubstr("\xE2\x80\xAE")), Not(HasSubstr("\xC2\x9B"))))
        << line.front();
  }
  EXPECT_THAT(run({"info", "evil.tps"}).out, HasSubstr("red\\x1b[31m\\x07 \\u202etxt.exe \\x9b1m"));
  const ProgramRun lines = run({"info", "no\nsuch\nfile"});
  EXPECT_EQ(count_lines(lines.err), 1U) << lines.err;
  EXPECT_THAT(run({"info", "bytes\xFF\xFE"}).err, HasSubstr("bytes\\xff\\xfe"));
}

TEST_F(Streams, HoldRecordsAsTheyAre) {
  write("named.tps", "LM=3\n0 0\n1 0\n0 1\nID=\xE2\x80\xAEname\n");
  EXPECT_THAT(run(words("info named.tps --json -")).out, HasSubstr("\"\xE2\x80\xAEname\""));
}

// OpenBLAS waits for ever for addresses that it does not get.
TEST_F(Streams, SayThatMemoryIsLimited) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitiser maps more than any limit";
#endif
  for (const char* limit : {"400000", "350000", "300000"}) {
    const ProgramRun done = bash("ulimit -v " + std::string(limit) + "; " + kRegister);
    EXPECT_EQ(done.exit_code, 2) << limit << done.err;
    EXPECT_EQ(count_lines(done.err), 1U) << done.err;
    EXPECT_THAT(done.err, AllOf(HasSubstr("ulimit -v"), HasSubstr(limit)));
  }
  // What the message names is enough.
  const std::string err = bash("ulimit -v 400000; " + std::string(kRegister)).err;
  const std::string needed = err.substr(err.find("; ") + 2, err.find(" kB are needed") - err.find("; ") - 2);
  EXPECT_EQ(bash("ulimit -v " + needed + "; " + kRegister + "2>/dev/null").exit_code, 0) << needed;
}

TEST_F(Streams, SayThatAFileIsTooLarge) {
  const ProgramRun done = bash("ulimit -f 4; $P register a.csv b.csv -o out --no-picture");
  EXPECT_EQ(done.exit_code, 2) << done.err;
  EXPECT_EQ(count_lines(done.err), 1U) << done.err;
  EXPECT_TRUE(names_in("out").empty());
}

TEST_F(Streams, SayThatMemoryIsFull) {
#ifdef __SANITIZE_ADDRESS__
  GTEST_SKIP() << "the sanitiser maps more than any limit";
#endif
  const ProgramRun done = bash(
      "ulimit -v 2000000; $P ensemble --q 0,1 --samples 400000 --time 1 --dt 0.01 --records 101 --save-paths p.npy -o "
      "out");
  EXPECT_EQ(done.exit_code, 2) << done.err;
  EXPECT_EQ(count_lines(done.err), 1U) << done.err;
}

}  // namespace
}  // namespace pulson
