#pragma once

#include <atomic>
#include <filesystem>
#include <mutex>
#include <string>

#include "arguments.hpp"
#include "view/live_map.hpp"
#include "view/local_server.hpp"
#include "view/saved_document.hpp"

namespace pulson {

/// Answers what the page asks for. Thread-safe.
class PageRequests {
 public:
  /// @param report a page that is linked to; empty: none
  PageRequests(view::SavedDocument& document, const ViewArguments& arguments, std::filesystem::path report)
      : document_(document), arguments_(arguments), report_(std::move(report)) {}

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
  const ViewArguments& arguments_;
  std::filesystem::path report_;
  std::mutex judging_, matching_;        // one of each at a time: a match uses all threads
  view::NearMatch near_;                 // of the last match, which the next may follow; behind matching_
  std::atomic<int> quick_requests_ = 0;  // that came: a match in full, which takes longer, ends for them
  std::atomic<bool> is_over_ = false;
};

}  // namespace pulson
