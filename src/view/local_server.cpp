#include "local_server.hpp"

#include <array>
#include <chrono>
#include <cstddef>
#include <exception>
#include <random>
#include <thread>

#include <fmt/format.h>
#include <httplib.h>
#include <nlohmann/json.hpp>

#include "pulson/core/errors.hpp"

namespace pulson::view {
namespace {

constexpr int kTokenWords = 4;                       // of 32 bits
constexpr std::size_t kThreads = 12;                 // a browser opens some six connections, also idle ones
constexpr int kPatience = 30;                        // seconds for a slow body
constexpr std::size_t kMostOfAnyBody = 1ULL << 30U;  // what httplib reads at most, whatever the path allows

std::string random_token() {
  std::random_device source;  // getentropy in libstdc++
  std::string token;
  for (int i = 0; i < kTokenWords; ++i) token += fmt::format("{:08x}", static_cast<std::uint32_t>(source()));
  return token;
}

// In a time that does not show how much of it agrees.
bool are_equal(std::string_view given, std::string_view token) {
  if (given.size() != token.size()) return false;
  unsigned differences = 0;
  for (std::size_t i = 0; i < token.size(); ++i)
    differences |= static_cast<unsigned char>(given[i]) ^ static_cast<unsigned char>(token[i]);
  return differences == 0;
}

// A second program must not be able to share the port, which SO_REUSEPORT, httplib's own choice, lets it.
void keep_port_alone(socket_t socket) {
  const int yes = 1;
  ::setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
}

constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' blob:; connect-src 'self'; "
    "base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

const httplib::Headers& headers_of_all() {
  static const httplib::Headers kHeaders = {{"Cross-Origin-Opener-Policy", "same-origin"},
                                            {"Cross-Origin-Resource-Policy", "same-origin"},
                                            {"X-Content-Type-Options", "nosniff"},
                                            {"X-Frame-Options", "DENY"},
                                            {"Referrer-Policy", "no-referrer"},
                                            {"Cache-Control", "no-store"}};
  return kHeaders;
}

}  // namespace

Reply error_reply(int status, std::string_view text) {
  return {status, "application/json",
          nlohmann::json{{"error", text}}.dump(-1, ' ', false, nlohmann::json::error_handler_t::replace)};
}

struct LocalServer::Implementation {
  httplib::Server server;
  std::string token = random_token();
  int port = 0;
  socket_t socket = INVALID_SOCKET;  // the last that was made, which is the one that listens
  Handler handler;
  Limit limit;
  std::thread thread;

  bool is_own_host(const std::string& host) const {
    return host == fmt::format("127.0.0.1:{}", port) || host == fmt::format("localhost:{}", port);
  }

  bool lets_in(const httplib::Request& request) const {
    const std::string host = request.get_header_value("Host");
    if (request.get_header_value_count("Host") != 1 || !is_own_host(host)) return false;
    if (request.has_header("Origin") && request.get_header_value("Origin") != "http://" + host) return false;
    if (request.has_header("Sec-Fetch-Site")) {
      const std::string site = request.get_header_value("Sec-Fetch-Site");
      if (site != "same-origin" && site != "none") return false;
    }
    if (request.method != "GET" && request.method != "POST") return false;
    const std::string_view path = request.path;
    return path.size() > token.size() + 1 && path[0] == '/' && path[token.size() + 1] == '/' &&
           are_equal(path.substr(1, token.size()), token);
  }

  // 0: the body may be read.
  int refusal_of_body(const httplib::Request& request) const {
    if (request.method != "POST") return request.has_header("Content-Length") ? 400 : 0;
    if (request.has_header("Transfer-Encoding") || !request.has_header("Content-Length")) return 411;
    const std::string length = request.get_header_value("Content-Length");
    if (length.empty() || length.size() > 12 || length.find_first_not_of("0123456789") != std::string::npos) return 400;
    return std::stoull(length) > limit(request.path.substr(token.size() + 2)) ? 413 : 0;
  }

  static void send(const Reply& reply, httplib::Response& response) {
    response.status = reply.status;
    response.set_header("Content-Security-Policy", reply.policy.empty() ? kPolicy : reply.policy);
    response.set_content(reply.body, reply.type);
  }

  void answer(const httplib::Request& request, httplib::Response& response) const {
    const Request plain{request.method, request.path.substr(token.size() + 2), request.get_param_value("name"),
                        request.body};
    try {
      send(handler(plain), response);
    } catch (const Error& error) {
      send(error_reply(422, error.what()), response);
    } catch (const std::bad_alloc&) {
      send(error_reply(507, "out of memory: this is too large for this machine"), response);
    } catch (const std::exception& error) {
      send(error_reply(500, fmt::format("internal error: {}", error.what())), response);
    }
  }

  void set_up() {
    using Pass = httplib::Server::HandlerResponse;
    server.new_task_queue = [] { return new httplib::ThreadPool(kThreads); };  // httplib deletes it
    server.set_socket_options([this](socket_t made) {
      keep_port_alone(made);
      socket = made;
    });
    server.set_tcp_nodelay(true);
    server.set_keep_alive_timeout(2);
    server.set_read_timeout(kPatience);
    server.set_payload_max_length(kMostOfAnyBody);
    server.set_default_headers(headers_of_all());
    server.set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
      if (!lets_in(request)) {
        response.set_header("Connection", "close");
        send({403, "text/plain", "forbidden\n"}, response);
        return Pass::Handled;
      }
      if (const int refusal = refusal_of_body(request); refusal != 0) {
        response.set_header("Connection", "close");  // its body is still on the way
        send(error_reply(refusal, refusal == 413 ? "this is larger than the page may send" : "a malformed request"),
             response);
        return Pass::Handled;
      }
      return Pass::Unhandled;
    });
    const auto handle = [this](const httplib::Request& request, httplib::Response& response) {
      answer(request, response);
    };
    server.Get(".*", handle);
    server.Post(".*", handle);
  }
};

LocalServer::LocalServer(int port, Handler handler, Limit limit) : implementation_(std::make_unique<Implementation>()) {
  implementation_->handler = std::move(handler);
  implementation_->limit = std::move(limit);
  implementation_->set_up();
  httplib::Server& server = implementation_->server;
  if (port == 0)
    implementation_->port = server.bind_to_any_port("127.0.0.1");
  else
    implementation_->port = server.bind_to_port("127.0.0.1", port) ? port : -1;
  if (implementation_->port <= 0)
    throw InputError(port == 0 ? std::string("no port of 127.0.0.1 can be had")
                               : fmt::format("port {} of 127.0.0.1 cannot be had; port 0 is any that is free", port));
  // httplib lets five wait: of hundreds at once some would be dropped, and closed when their request comes too late.
  ::listen(implementation_->socket, SOMAXCONN);
}

LocalServer::~LocalServer() {
  implementation_->server.stop();
  if (implementation_->thread.joinable()) implementation_->thread.join();
}

std::string LocalServer::url() const {
  return fmt::format("http://127.0.0.1:{}/{}/", implementation_->port, implementation_->token);
}

void LocalServer::start() {
  implementation_->thread = std::thread([this] { implementation_->server.listen_after_bind(); });
  // stop() does nothing before it runs, and the end of the object would wait for ever.
  while (!implementation_->server.is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
}

}  // namespace pulson::view
