#pragma once

#include <atomic>
#include <map>
#include <mutex>
#include <string>

#include "arguments.hpp"
#include "opened_shapes.hpp"
#include "view/local_server.hpp"
#include "view/saved_document.hpp"

namespace pulson {

/// Answers what the page asks for. Thread-safe.
class PageRequests {
 public:
  PageRequests(view::SavedDocument& document, std::map<std::string, OpenedShape> opened, const ViewArguments& arguments)
      : document_(document), opened_(std::move(opened)), arguments_(arguments) {}

  view::Reply answer(const view::Request& request);
  /// Most bytes that it may send there.
  static std::size_t most_bytes(std::string_view path);

  /// Whether the page asked for the end.
  bool is_over() const { return is_over_; }

 private:
  view::Reply get(const view::Request& request);
  view::Reply post(const view::Request& request);
  view::Reply state() const;
  view::Reply picture(const std::string& number) const;
  view::Reply save(const std::string& body);
  view::Reply take_picture(const view::Request& request);
  view::Reply judge(const std::string& body);
  view::Reply match(const std::string& body);
  view::Reply write_export(const std::string& body);

  view::SavedDocument& document_;
  std::map<std::string, OpenedShape> opened_;
  const ViewArguments& arguments_;
  std::mutex judging_, matching_;  // one of each at a time: a match uses all threads
  std::atomic<bool> is_over_ = false;
};

}  // namespace pulson
