#include "view/local_server.hpp"

#include <atomic>
#include <thread>

#include <gmock/gmock.h>
#include <httplib.h>

#include "pulson/core/errors.hpp"

namespace pulson::view {
namespace {

// A server that says what it was asked, and how to reach it.
struct Served {
  std::atomic<int> calls = 0;
  LocalServer server{0,
                     [this](const Request& request) {
                       ++calls;
                       if (request.path == "fails") throw InputError("it is wrong");
                       return Reply{200, "text/plain", request.method + " " + request.path + " " + request.body};
                     },
                     [](std::string_view path) { return path == "large" ? 1000U : 10U; }};
  int port;
  std::string token, host;

  Served() {
    server.start();
    const std::string url = server.url(), start = "http://127.0.0.1:";
    EXPECT_TRUE(url.starts_with(start));
    const std::size_t slash = url.find('/', start.size());
    port = std::stoi(url.substr(start.size(), slash - start.size()));
    token = url.substr(slash, url.size() - slash - 1);  // with the first slash
    host = "127.0.0.1:" + std::to_string(port);
  }

  int get(const std::string& path, const httplib::Headers& headers = {}) const {
    httplib::Client client("127.0.0.1", port);
    const auto result = client.Get(path, headers);
    return result ? result->status : -1;
  }
  int post(const std::string& path, const std::string& body, const httplib::Headers& headers = {}) const {
    httplib::Client client("127.0.0.1", port);
    const auto result = client.Post(path, headers, body, "application/json");
    return result ? result->status : -1;
  }
};

TEST(LocalServer, AnswersBehindItsToken) {
  const Served served;
  EXPECT_EQ(served.token.size(), 33U);
  httplib::Client client("127.0.0.1", served.port);
  const auto result = client.Get(served.token + "/a.js");
  ASSERT_TRUE(result);
  EXPECT_EQ(result->body, "GET a.js ");
  EXPECT_THAT(result->get_header_value("Content-Security-Policy"), testing::HasSubstr("default-src 'none'"));
  EXPECT_EQ(result->get_header_value("X-Content-Type-Options"), "nosniff");
}

TEST(LocalServer, RefusesAllElseWithOneWord) {
  const Served served;
  std::string other = served.token;
  other.back() = other.back() == '0' ? '1' : '0';
  for (const std::string& path :
       {std::string("/"), std::string("/state"), other + "/", served.token, "/x" + served.token + "/",
        served.token + "0/", std::string("/favicon.ico"), "//" + served.token.substr(1) + "/"})
    EXPECT_EQ(served.get(path), 403) << path;
  const std::string path = served.token + "/";
  EXPECT_EQ(served.get(path, {{"Host", "evil.example"}}), 403);
  EXPECT_EQ(served.get(path, {{"Host", "evil.example:" + std::to_string(served.port)}}), 403);
  EXPECT_EQ(served.get(path, {{"Host", "127.0.0.1"}}), 403);
  EXPECT_EQ(served.get(path, {{"Origin", "http://evil.example"}}), 403);
  EXPECT_EQ(served.get(path, {{"Origin", "null"}}), 403);
  EXPECT_EQ(served.get(path, {{"Origin", "https://" + served.host}}), 403);
  EXPECT_EQ(served.get(path, {{"Sec-Fetch-Site", "cross-site"}}), 403);
  EXPECT_EQ(served.post(path, "{}", {{"Origin", "http://evil.example"}}), 403);
  httplib::Client client("127.0.0.1", served.port);
  EXPECT_EQ(client.Put(path, "", "text/plain")->status, 403);
  EXPECT_EQ(client.Options(path)->status, 403);
  EXPECT_EQ(client.Delete(path)->status, 403);
  EXPECT_EQ(served.calls, 0);
  EXPECT_EQ(served.get(path, {{"Origin", "http://" + served.host}, {"Sec-Fetch-Site", "same-origin"}}), 200);
  EXPECT_EQ(served.get(path, {{"Host", "localhost:" + std::to_string(served.port)}}), 200);
}

TEST(LocalServer, LimitsBodiesByPath) {
  const Served served;
  EXPECT_EQ(served.post(served.token + "/small", std::string(10, 'a')), 200);
  EXPECT_EQ(served.post(served.token + "/small", std::string(11, 'a')), 413);
  EXPECT_EQ(served.post(served.token + "/large", std::string(900, 'a')), 200);
  httplib::Client client("127.0.0.1", served.port);
  const auto chunked = client.Post(
      served.token + "/small",
      [](std::size_t, httplib::DataSink& sink) { return sink.write("a", 1), sink.done(), true; }, "text/plain");
  // A refusal is sent before the body is read: where the system resets the connection for that, the client may miss it.
  EXPECT_THAT(chunked ? chunked->status : -1, testing::AnyOf(411, -1));
  EXPECT_EQ(served.calls, 2);
}

TEST(LocalServer, SaysWhatIsWrong) {
  const Served served;
  httplib::Client client("127.0.0.1", served.port);
  const auto result = client.Get(served.token + "/fails");
  ASSERT_TRUE(result);
  EXPECT_EQ(result->status, 422);
  EXPECT_EQ(result->body, R"({"error":"it is wrong"})");
}

TEST(LocalServer, Answers500RequestsAtOnce) {
  Served served;
  std::atomic<int> good = 0;
  std::vector<std::thread> threads;
  for (int t = 0; t < 50; ++t)
    threads.emplace_back([&] {
      for (int i = 0; i < 10; ++i) good += served.get(served.token + "/") == 200 ? 1 : 0;
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(good, 500);
}

TEST(LocalServer, DoesNotShareItsPort) {
  const Served served;
  EXPECT_THROW(LocalServer(
                   served.port, [](const Request&) { return Reply{}; }, [](auto) { return std::size_t{0}; }),
               InputError);
}

TEST(LocalServer, HasAnotherTokenEachTime) {
  const Served first, second;
  EXPECT_NE(first.token, second.token);
}

}  // namespace
}  // namespace pulson::view
