// The program as several processes that mpirun starts: the same bits as one process, messages of one, and an orderly
// end.

#include <chrono>
#include <csignal>
#include <fstream>
#include <thread>

#include <gmock/gmock.h>

#include "ensemble_program.hpp"

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

constexpr int kGrace = 10;  // seconds to save what is there, on a machine that is busy with other tests

class RanksProgram : public EnsembleProgram {
 protected:
  /// `grace`: seconds that mpirun waits twice before it kills.
  static pid_t start_ranks(int ranks, const std::string& line, int grace = 1) {
    // As root, and with more ranks than cores.
    ::setenv("OMPI_ALLOW_RUN_AS_ROOT", "1", 1);
    ::setenv("OMPI_ALLOW_RUN_AS_ROOT_CONFIRM", "1", 1);
    ::setenv("OMPI_MCA_odls_base_sigkill_timeout", std::to_string(grace).c_str(), 1);
    Arguments arguments =
        joined({PULSON_MPIRUN, "--oversubscribe", "-n", std::to_string(ranks), PULSON_PROGRAM}, words(line));
    const pid_t child = ::fork();
    if (child != 0) return child;
    const int out = ::open("out.txt", O_WRONLY | O_CREAT | O_TRUNC, 0600);
    const int err = ::open("err.txt", O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (out < 0 || err < 0 || ::dup2(out, STDOUT_FILENO) < 0 || ::dup2(err, STDERR_FILENO) < 0) ::_exit(126);
    std::vector<char*> pointers;
    for (std::string& argument : arguments) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    ::alarm(kPatience);
    ::execv(PULSON_MPIRUN, pointers.data());
    ::_exit(127);
  }

  static ProgramRun finished(pid_t child) {
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    const ProgramRun run{WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status), contents("out.txt"),
                         contents("err.txt")};
    std::filesystem::remove("out.txt");
    std::filesystem::remove("err.txt");
    return run;
  }

  static ProgramRun run_ranks(int ranks, const std::string& line) { return finished(start_ranks(ranks, line)); }

  /// The words of /proc/PID/stat from the third on; the second, in parentheses, may hold blanks.
  static Arguments facts_of(const std::string& process) {
    std::ifstream file("/proc/" + process + "/stat");
    const std::string text{std::istreambuf_iterator<char>(file), {}};
    return words(text.substr(std::min(text.size(), text.rfind(')') + 1)));
  }

  /// The ranks that this mpirun started, once all of them have computed for a while.
  static std::vector<pid_t> working_ranks(pid_t mpirun, std::size_t count) {
    const auto is_ours = [&](const std::string& name) {
      const Arguments facts = facts_of(name);
      return facts.size() > 11 && facts[1] == std::to_string(mpirun) &&
             std::stod(facts[11]) > 0.3 * static_cast<double>(::sysconf(_SC_CLK_TCK));
    };
    for (;; std::this_thread::sleep_for(std::chrono::milliseconds(10))) {
      std::vector<pid_t> found;
      for (const auto& entry : std::filesystem::directory_iterator("/proc")) {
        const std::string name = entry.path().filename();
        if (std::isdigit(static_cast<unsigned char>(name.front())) != 0 && is_ours(name))
          found.push_back(std::stoi(name));
      }
      if (found.size() == count) return found;
      if (facts_of(std::to_string(mpirun)).empty() || facts_of(std::to_string(mpirun)).front() == "Z") return {};
    }
  }

  static std::size_t lines_that_begin(const std::string& text, const std::string& word) {
    std::istringstream stream(text);
    std::size_t count = 0;
    for (std::string line; std::getline(stream, line);) count += line.starts_with(word) ? 1 : 0;
    return count;
  }
};

TEST_F(RanksProgram, SampleTheSameBitsForAnyNumber) {
  const std::string kRun = kPair + std::string("--time 10 --samples 5000 ");
  ASSERT_EQ(run(words(kRun + "-o whole --save-final whole.npy")).exit_code, 0);
  for (const int ranks : {1, 2, 3}) {
    SCOPED_TRACE(ranks);
    const ProgramRun done = run_ranks(ranks, kRun + "-o out --save-final out.npy");
    ASSERT_EQ(done.exit_code, 0) << done.err;
    EXPECT_EQ(done.err, "");
    EXPECT_EQ(lines_that_begin(done.out, "sampled"), 1U) << done.out;
    expect_same_results("whole", "out");
    EXPECT_TRUE(contents("whole.npy") == contents("out.npy"));
  }
}

TEST_F(RanksProgram, ShareTheirMachine) {
  const ProgramRun done = run_ranks(4, kPair + std::string("--time 10 --samples 500 -o out"));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_LE(read_json("out/ensemble.json")["threads"], std::max(4U, std::thread::hardware_concurrency()));
}

TEST_F(RanksProgram, WorkOnShards) {
  const std::string kRun = kPair + std::string("--time 10 --samples 3000 --antithetic ");
  ASSERT_EQ(run(words(kRun + "-o whole")).exit_code, 0);
  ASSERT_EQ(run_ranks(2, kRun + "-o parts --shard 1/2").exit_code, 0);
  ASSERT_EQ(run(words(kRun + "-o parts --shard 2/2")).exit_code, 0);
  EXPECT_EQ(run(words("merge parts/part-1-of-2.ensemble parts/part-2-of-2.ensemble --no-picture -o out")).exit_code, 0);
  expect_same_results("whole", "out");
}

TEST_F(RanksProgram, RefuseWhatIsWrongOnce) {
  for (const auto& [line, message] :
       {std::pair<std::string, std::string>{kPair + std::string("--samples 0 -o out"), "--samples is 0"},
        {kPair + std::string("--samples 100 -o /dev/null/out"), "'/dev/null/out'"},
        {kPair + std::string("--samples 100 -o out --nosuch"), "unknown option '--nosuch'"},
        {"compare " PULSON_SOURCE_DIR "/sample_shapes/leaves.tps --simulate ch-ds -o out", "unknown noise 'ch-ds'"},
        {"info kernels", "'info' is for one process, and there are 3 ranks"}}) {
    SCOPED_TRACE(line);
    const ProgramRun refused = run_ranks(3, line);
    EXPECT_EQ(refused.exit_code, 2) << refused.err;
    EXPECT_EQ(refused.out, "");
    EXPECT_EQ(lines_that_begin(refused.err, "pulson: "), 1U) << refused.err;
    EXPECT_THAT(refused.err, Not(HasSubstr("MPI_ABORT")));  // the others go home without
    EXPECT_FALSE(std::filesystem::exists("out/ensemble.json"));
  }
}

TEST_F(RanksProgram, StopAfterASignalAndGoOn) {
  const std::string kRun = kPair + std::string("--samples 200000 ");
  const pid_t mpirun = start_ranks(2, kRun + "-o parts", kGrace);
  ASSERT_EQ(working_ranks(mpirun, 2).size(), 2U);
  ::kill(mpirun, SIGINT);
  const ProgramRun stopped = finished(mpirun);
  EXPECT_EQ(lines_that_begin(stopped.err, "warning: partial: "), 1U) << stopped.err;
  EXPECT_LT(read_json("parts/ensemble.json")["samples"], 200000);
  ASSERT_EQ(run_ranks(3, kRun + "-o parts --resume").exit_code, 0);
  ASSERT_EQ(run(words(kRun + "-o whole")).exit_code, 0);
  expect_same_results("whole", "parts");
}

TEST_F(RanksProgram, LeaveACheckpointWhereOneIsKilled) {
  const std::string kRun = kPair + std::string("--samples 200000 ");
  const pid_t mpirun = start_ranks(2, kRun + "-o parts", kGrace);
  const std::vector<pid_t> ranks = working_ranks(mpirun, 2);
  ASSERT_EQ(ranks.size(), 2U);
  ::kill(std::max(ranks[0], ranks[1]), SIGKILL);
  EXPECT_NE(finished(mpirun).exit_code, 0);
  EXPECT_TRUE(std::filesystem::exists("parts/ensemble.partial"));
  const ProgramRun done = run_ranks(2, kRun + "-o parts --resume");
  ASSERT_EQ(done.exit_code, 0) << done.err;
  ASSERT_EQ(run(words(kRun + "-o whole")).exit_code, 0);
  expect_same_results("whole", "parts");
}

}  // namespace
}  // namespace pulson
