#pragma once

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <iterator>
#include <map>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <fcntl.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>
#include <sys/wait.h>
#include <unistd.h>

#include "temporary_folder.hpp"

namespace pulson {

/// What a child process left behind. A child that a signal ended has the exit code minus the signal's number.
struct ProgramRun {
  int exit_code = 0;
  std::string out;
  std::string err;
};

/// Seconds until a child is ended by SIGALRM.
#ifdef __SANITIZE_ADDRESS__
inline constexpr unsigned kPatience = 3000;
#else
inline constexpr unsigned kPatience = 300;
#endif

/// How the child is started, where it matters.
struct ProgramSetting {
  std::string out_path = "captured_out";  ///< where its standard output goes
  std::string search_path{};              ///< its PATH, where not empty
  unsigned limit = kPatience;
};

/// What INSTANTIATE_TEST_SUITE_P may call a test whose parameter has a name.
inline constexpr auto kName = [](const auto& parameter) { return parameter.param.name; };

/// Runs the built program, which inherits the working folder: a temporary one, removed afterwards.
class Program : public InTemporaryFolder {
 protected:
  using Arguments = std::vector<std::string>;

  static ProgramRun run(const Arguments& arguments, const ProgramSetting& setting = {}) {
    const pid_t child = ::fork();
    if (child == 0) become_program(arguments, setting);
    int status = 0;
    EXPECT_EQ(::waitpid(child, &status, 0), child);
    ProgramRun result;
    result.exit_code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    result.out = contents("captured_out");
    result.err = contents("captured_err");
    std::filesystem::remove("captured_out");
    std::filesystem::remove("captured_err");
    return result;
  }

  /// The words of a line, which hold no blanks.
  static Arguments words(const std::string& line) {
    std::istringstream stream(line);
    return {std::istream_iterator<std::string>(stream), std::istream_iterator<std::string>()};
  }

  static Arguments joined(Arguments first, const Arguments& second) {
    first.insert(first.end(), second.begin(), second.end());
    return first;
  }

  /// Every file below the working folder with its contents. Empty folders do not count.
  static std::map<std::string, std::string> all_files() {
    std::map<std::string, std::string> files;
    std::error_code no_target;  // of a link
    for (const auto& entry : std::filesystem::recursive_directory_iterator("."))
      if (entry.is_regular_file(no_target)) files[entry.path().string()] = contents(entry.path().string());
    return files;
  }

  /// Names of the files that came, went or changed since `before` was taken.
  static std::set<std::string> changed_since(const std::map<std::string, std::string>& before) {
    const std::map<std::string, std::string> after = all_files();
    std::set<std::string> names;
    for (const auto& [name, text] : before)
      if (const auto found = after.find(name); found == after.end() || found->second != text) names.insert(name);
    for (const auto& [name, text] : after)
      if (before.count(name) == 0) names.insert(name);
    return names;
  }

  static std::vector<std::string> names_in(const std::string& folder) {
    std::vector<std::string> names;
    if (!std::filesystem::exists(folder)) return names;
    for (const auto& entry : std::filesystem::directory_iterator(folder)) names.push_back(entry.path().filename());
    std::sort(names.begin(), names.end());
    return names;
  }

  static nlohmann::json read_json(const std::string& name) {
    return nlohmann::json::parse(contents(name), nullptr, false);
  }

  static std::size_t count_lines(const std::string& text) {
    return static_cast<std::size_t>(std::count(text.begin(), text.end(), '\n'));
  }

  static std::string sample(const std::string& name) {
    return (std::filesystem::path(PULSON_SOURCE_DIR) / "sample_shapes" / (name + ".csv")).string();
  }

  /// The folder of real data, which need not be there.
  static std::filesystem::path data_folder() {
    const char* const given = std::getenv("PULSON_DATA");
    return given != nullptr ? std::filesystem::path(given)
                            : std::filesystem::path(PULSON_SOURCE_DIR) / ".." / "shared" / "data";
  }

 private:
  [[noreturn]] static void become_program(const Arguments& arguments, const ProgramSetting& setting) {
    const int flags = O_WRONLY | O_CREAT | O_TRUNC;
    const int out = ::open(setting.out_path.c_str(), flags, 0600);
    const int err = ::open("captured_err", flags, 0600);
    if (out < 0 || err < 0 || ::dup2(out, STDOUT_FILENO) < 0 || ::dup2(err, STDERR_FILENO) < 0) ::_exit(126);
    if (!setting.search_path.empty()) ::setenv("PATH", setting.search_path.c_str(), 1);
    std::vector<std::string> strings = joined({PULSON_PROGRAM}, arguments);
    std::vector<char*> pointers;
    for (std::string& string : strings) pointers.push_back(string.data());
    pointers.push_back(nullptr);
    ::alarm(setting.limit);
    ::execv(PULSON_PROGRAM, pointers.data());
    ::_exit(127);
  }
};

}  // namespace pulson
