#include "newick.hpp"

#include <algorithm>
#include <cmath>
#include <set>

#include <fmt/core.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson::formats {
namespace {

constexpr double kNoLength = -1;

class NewickReader {
 public:
  NewickReader(const std::string& path, std::string_view text) : path_(path), text_(text) {}

  std::vector<TreeNode> read() {
    open(-1);
    while (depth_ >= 0) {
      take_label();
      skip();
      const char next = take();
      if (next == ',') {
        if (depth_ == 0) fail("',' outside of all parentheses: it is no Newick tree");
        open(nodes_[at_].parent);
      } else if (next == ')') {
        close();
      } else if (next == ';' || next == '\0') {
        if (depth_ > 0) fail(fmt::format("{} '(' without ')'", depth_));
        break;
      } else {
        fail(fmt::format("{} where ',', ')' or ';' is expected", text::in_quotes(std::string(1, next))));
      }
    }
    skip();
    if (place_ < text_.size()) fail("there is more than one tree; one is needed");
    if (nodes_.size() < 2) fail("the tree has no branch");
    check();
    return std::move(nodes_);
  }

 private:
  [[noreturn]] void fail(const std::string& message) const {
    const auto end = text_.begin() + static_cast<std::ptrdiff_t>(std::min(place_, text_.size()));
    text::fail(path_, static_cast<std::size_t>(std::count(text_.begin(), end, '\n')) + 1, message);
  }

  // A node, and those within its parentheses, up to the first leaf.
  void open(int parent) {
    for (;;) {
      at_ = nodes_.size();
      nodes_.push_back({"", parent, kNoLength});
      skip();
      if (peek() != '(') return;
      ++place_;
      ++depth_;
      parent = static_cast<int>(at_);
    }
  }

  // Back to the parent, whose label follows.
  void close() {
    if (depth_ == 0) fail("')' without '('");
    --depth_;
    at_ = static_cast<std::size_t>(nodes_[at_].parent);
  }

  void take_label() {
    skip();
    TreeNode& node = nodes_[at_];
    node.name = peek() == '\'' ? quoted() : std::string(text::trim(plain()));
    skip();
    if (peek() != ':') return;
    ++place_;
    skip();
    const std::string length(text::trim(plain()));
    node.length = text::is_number(length) ? parse_number(length, "a branch") : NAN;
    if (!(std::isfinite(node.length) && node.length >= 0))
      fail(fmt::format("the length of a branch is {}; a number that is not negative is needed",
                       text::in_quotes(length)));
  }

  std::string quoted() {
    std::string label;
    for (++place_;; ++place_) {
      if (place_ == text_.size()) fail("a label has no closing quote");
      if (text_[place_] != '\'') {
        label += text_[place_];
      } else if (place_ + 1 < text_.size() && text_[place_ + 1] == '\'') {
        label += text_[++place_];
      } else {
        ++place_;
        return label;
      }
    }
  }

  std::string_view plain() {
    const std::size_t begin = place_;
    while (place_ < text_.size() && std::string_view("(),:;[]'").find(text_[place_]) == std::string_view::npos)
      ++place_;
    return text_.substr(begin, place_ - begin);
  }

  // Blanks, and comments in brackets.
  void skip() {
    while (place_ < text_.size()) {
      if (text_[place_] == '[') {
        const std::size_t end = text_.find(']', place_);
        if (end == std::string_view::npos) fail("'[' without ']'");
        place_ = end + 1;
      } else if (std::string_view(" \t\r\n").find(text_[place_]) != std::string_view::npos) {
        ++place_;
      } else {
        return;
      }
    }
  }

  char peek() const { return place_ < text_.size() ? text_[place_] : '\0'; }
  char take() {
    const char next = peek();
    if (place_ < text_.size()) ++place_;
    return next;
  }

  void check() {
    const auto lengths =
        std::count_if(nodes_.begin() + 1, nodes_.end(), [](const TreeNode& node) { return node.length != kNoLength; });
    if (lengths != 0 && lengths + 1 != std::ssize(nodes_))
      fail(fmt::format("{} of {} branches have a length; all or none are needed", lengths, nodes_.size() - 1));
    if (lengths == 0)
      for (TreeNode& node : nodes_) node.length = 1;
    nodes_.front().length = 0;
    std::set<std::string> names;
    for (const TreeNode& node : nodes_)
      if (!node.name.empty() && !names.insert(node.name).second)
        fail(fmt::format("two nodes are called {}", text::in_quotes(node.name)));
  }

  const std::string& path_;
  std::string_view text_;
  std::size_t place_ = 0;
  std::vector<TreeNode> nodes_;
  std::size_t at_ = 0;  // the node that is read
  int depth_ = 0;
};

}  // namespace

std::vector<TreeNode> parse_newick(const std::string& path, std::string_view text) {
  return NewickReader(path, text).read();
}

}  // namespace pulson::formats
