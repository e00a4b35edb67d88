#pragma once

#include <functional>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

namespace pulson::view {

/// What a handler sees of a request that was let in.
struct Request {
  std::string method;  ///< GET or POST
  std::string path;    ///< behind the token, without the first slash; may be empty
  std::string query;   ///< the value of the parameter `name`; may be empty
  std::string body;
};

struct Reply {
  int status = 200;
  std::string type = "application/json";
  std::string body = {};
  std::string policy = {};  ///< Content-Security-Policy; empty: that of the page's own files
};

/// {"error": text}
Reply error_reply(int status, std::string_view text);

/// A server for one page on this machine, for the person who started it alone:
///
/// - it listens on 127.0.0.1;
/// - every path begins with a token of 128 random bits, http://127.0.0.1:PORT/TOKEN/;
/// - Host must be that address, so that no name of another site leads here (DNS rebinding);
/// - Origin and Sec-Fetch-Site, where a browser sends them, must be those of the page itself.
///
/// All else gets 403 and no other word. Bodies are limited before they are read.
class LocalServer {
 public:
  using Handler = std::function<Reply(const Request&)>;
  /// Most bytes of the body of a POST to a path.
  using Limit = std::function<std::size_t(std::string_view path)>;

  /// @param port 0: any that is free @throws InputError where it cannot be had
  LocalServer(int port, Handler handler, Limit limit);
  ~LocalServer();
  LocalServer(const LocalServer&) = delete;
  LocalServer& operator=(const LocalServer&) = delete;

  /// http://127.0.0.1:PORT/TOKEN/
  std::string url() const;

  /// Answers requests, on threads of its own, until the end of the object.
  void start();

 private:
  struct Implementation;
  std::unique_ptr<Implementation> implementation_;
};

}  // namespace pulson::view
