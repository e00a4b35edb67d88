#pragma once

// `pulson view` as a process that a test talks to.

#include <array>
#include <csignal>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>  // before httplib, whose <resolv.h> defines _res
#include <gtest/gtest.h>
#include <httplib.h>
#include <nlohmann/json.hpp>
#include <sys/resource.h>

#include "program.hpp"

namespace pulson {

using nlohmann::json;

/// A running program, which is killed at the end.
class Server {
 public:
  /// @param most_bytes of a file that it may write; 0: any
  explicit Server(const std::vector<std::string>& arguments, rlim_t most_bytes = 0) {
    std::array<int, 2> ends{};
    EXPECT_EQ(::pipe(ends.data()), 0);
    child_ = ::fork();
    if (child_ == 0) become(arguments, ends, most_bytes);
    ::close(ends[1]);
    std::string line;
    for (char c = 0; ::read(ends[0], &c, 1) == 1 && c != '\n';) line += c;
    ::close(ends[0]);
    const std::string start = "http://127.0.0.1:";
    EXPECT_TRUE(line.starts_with(start)) << line;
    const std::size_t slash = line.find('/', start.size());
    port_ = std::stoi(line.substr(start.size(), slash - start.size()));
    path_ = line.substr(slash);
  }
  ~Server() { kill(SIGKILL); }
  Server(const Server&) = delete;
  Server& operator=(const Server&) = delete;

  /// @return the exit code, or minus the signal
  int kill(int signal) {
    if (child_ <= 0) return 0;
    ::kill(child_, signal);
    int status = 0;
    ::waitpid(child_, &status, 0);
    child_ = -1;
    return WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  }

  httplib::Result reply_of(const std::string& name) { return httplib::Client("127.0.0.1", port_).Get(path_ + name); }
  std::string text_of(const std::string& name, const json& body) {
    const auto result = httplib::Client("127.0.0.1", port_).Post(path_ + name, body.dump(), "application/json");
    return result && result->status == 200 ? result->body : std::string(4, '?');
  }
  std::pair<int, json> get(const std::string& name) {
    httplib::Client client("127.0.0.1", port_);
    const auto result = client.Get(path_ + name);
    return {result ? result->status : -1, result ? json::parse(result->body, nullptr, false) : json()};
  }
  std::pair<int, json> post(const std::string& name, const json& body) { return post_bytes(name, body.dump()); }
  std::pair<int, json> post_bytes(const std::string& name, const std::string& body) {
    httplib::Client client("127.0.0.1", port_);
    client.set_read_timeout(60);
    const auto result = client.Post(path_ + name, body, "application/octet-stream");
    return {result ? result->status : -1, result ? json::parse(result->body, nullptr, false) : json()};
  }

  json document() { return get("state").second["document"]; }
  int save(const json& document) {
    return post("state", {{"base", document["revision"]}, {"document", document}}).first;
  }

 private:
  [[noreturn]] static void become(const std::vector<std::string>& arguments, const std::array<int, 2>& ends,
                                  rlim_t most_bytes) {
    ::dup2(ends[1], STDOUT_FILENO);
    ::close(ends[0]);
    const int null = ::open("/dev/null", O_WRONLY);
    ::dup2(null, STDERR_FILENO);
    if (most_bytes > 0) {
      const rlimit limit{most_bytes, most_bytes};
      ::setrlimit(RLIMIT_FSIZE, &limit);
    }
    std::vector<std::string> all = {PULSON_PROGRAM, "view", "--no-browser"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    std::vector<char*> pointers;
    for (std::string& argument : all) pointers.push_back(argument.data());
    pointers.push_back(nullptr);
    ::execv(PULSON_PROGRAM, pointers.data());
    ::_exit(127);
  }

  pid_t child_ = -1;
  int port_ = 0;
  std::string path_;
};

class ViewProgram : public Program {
 protected:
  void SetUp() override {
    InTemporaryFolder::SetUp();
    const std::filesystem::path samples = std::filesystem::path(PULSON_SOURCE_DIR) / "sample_shapes";
    for (const char* name : {"leaf_1.png", "leaf_2.png", "leaves.tps"}) std::filesystem::copy(samples / name, name);
  }

  static json placed(json document, const std::vector<std::vector<json>>& points) {
    document["landmarks"] = json::array();
    for (std::size_t k = 0; k < points[0].size(); ++k) document["landmarks"].push_back({{"name", ""}, {"group", ""}});
    for (std::size_t s = 0; s < points.size(); ++s) document["specimens"][s]["points"] = points[s];
    return document;
  }
};

}  // namespace pulson
