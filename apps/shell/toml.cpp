// The part of TOML that options need. CLI11's own reader cuts "file.tps#1" at the #, knows no escapes and takes
// "alpha=1,weight=2" for a list.

#include "toml.hpp"

#include <algorithm>
#include <cctype>
#include <cstdint>
#include <regex>
#include <set>
#include <utility>

#include <fmt/format.h>

#include "pulson/core/errors.hpp"

namespace pulson {
namespace {

bool is_bare(char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0 || c == '-' || c == '_'; }

void append_utf8(std::string& text, std::uint32_t code) {
  const auto byte = [&](std::uint32_t value) { text += static_cast<char>(value); };
  if (code < 0x80) return byte(code);
  if (code < 0x800) {
    byte(0xC0U | code >> 6U);
  } else {
    if (code < 0x10000) {
      byte(0xE0U | code >> 12U);
    } else {
      byte(0xF0U | code >> 18U);
      byte(0x80U | (code >> 12U & 0x3FU));
    }
    byte(0x80U | (code >> 6U & 0x3FU));
  }
  byte(0x80U | (code & 0x3FU));
}

class Reader {
 public:
  Reader(std::string path, std::string_view text) : path_(std::move(path)), text_(text) {}

  ConfigFile read() {
    if (text_.substr(0, 3) == "\xEF\xBB\xBF") at_ = 3;
    for (skip_lines(); !at_end(); skip_lines()) {
      if (peek() == '[')
        read_section();
      else
        read_setting();
      end_line();
    }
    return std::move(config_);
  }

 private:
  bool at_end() const { return at_ >= text_.size(); }
  char peek(std::size_t ahead = 0) const { return at_ + ahead < text_.size() ? text_[at_ + ahead] : '\0'; }
  std::string place() const { return fmt::format("{}:{}", path_, line_); }
  [[noreturn]] void fail(const std::string& message) const { throw InputError(place() + ": " + message); }

  void skip_blanks() {
    while (peek() == ' ' || peek() == '\t' || (peek() == '\r' && peek(1) == '\n')) ++at_;
    if (peek() == '#')
      while (!at_end() && peek() != '\n') ++at_;
  }

  /// Blanks, comments and ends of lines.
  void skip_lines() {
    for (skip_blanks(); peek() == '\n' && !at_end(); skip_blanks()) {
      ++at_;
      ++line_;
    }
  }

  void end_line() {
    skip_blanks();
    if (!at_end() && peek() != '\n') fail(fmt::format("'{}' is left over after the value", rest_of_line()));
  }

  std::string rest_of_line() const {
    return std::string(text_.substr(at_, std::min(text_.find_first_of("\r\n", at_), text_.size()) - at_));
  }

  std::string read_key() {
    if (peek() == '"' || peek() == '\'') return read_string();
    std::string key;
    while (is_bare(peek())) key += text_[at_++];
    if (key.empty()) fail(fmt::format("'{}': a name is needed, as in steps = 40", rest_of_line()));
    return key;
  }

  void read_section() {
    ++at_;
    if (peek() == '[') fail("lists of tables [[…]] are not used here; [register] is");
    skip_blanks();
    section_ = read_key();
    skip_blanks();
    if (peek() != ']') fail(fmt::format("']' is needed after [{}", section_));
    ++at_;
    const auto same = [&](const auto& each) { return each.first == section_; };
    if (std::any_of(config_.sections.begin(), config_.sections.end(), same))
      fail(fmt::format("the section [{}] is there twice", section_));
    config_.sections.emplace_back(section_, place());
  }

  void read_setting() {
    Setting setting{section_, read_key(), {}, Setting::Kind::kText, place()};
    skip_blanks();
    if (peek() != '=') fail(fmt::format("'=' and a value are needed after {}", setting.key));
    ++at_;
    skip_blanks();
    if (!seen_.emplace(section_, setting.key).second) fail(fmt::format("{} is there twice", setting.key));
    if (peek() == '[')
      read_list(setting);
    else
      setting.values = {read_scalar(setting.kind)};
    config_.settings.push_back(std::move(setting));
  }

  void read_list(Setting& setting) {
    setting.kind = Setting::Kind::kList;
    Setting::Kind kind{};
    ++at_;
    for (skip_lines(); peek() != ']'; skip_lines()) {
      setting.values.push_back(read_scalar(kind));
      skip_lines();
      if (peek() == ',')
        ++at_;
      else if (peek() != ']')
        fail(fmt::format("',' or ']' is needed in the list of {}", setting.key));
    }
    ++at_;
  }

  std::string read_scalar(Setting::Kind& kind) {
    if (peek() == '"' || peek() == '\'') {
      kind = Setting::Kind::kText;
      return read_string();
    }
    std::string word;
    while (!at_end() && std::string_view(" \t\r\n,]#").find(peek()) == std::string_view::npos) word += text_[at_++];
    kind = word == "true" || word == "false" ? Setting::Kind::kWord : Setting::Kind::kNumber;
    if (kind == Setting::Kind::kNumber && !is_toml_number(word))
      fail(fmt::format("'{}' is not a number, true or false; strings need quotes, \"…\"", word));
    word.erase(std::remove(word.begin(), word.end(), '_'), word.end());
    return word;
  }

  std::string read_string() {
    const char quote = peek();
    if (peek(1) == quote && peek(2) == quote) fail("strings over several lines are not used here");
    ++at_;
    std::string value;
    while (peek() != quote) {
      if (at_end() || peek() == '\n') fail(fmt::format("the closing {} is missing", quote));
      if (quote == '"' && peek() == '\\')
        read_escape(value);
      else
        value += text_[at_++];
    }
    ++at_;
    return value;
  }

  void read_escape(std::string& value) {
    constexpr std::string_view kNames = "btnfre\"\\";
    constexpr std::string_view kMeant = "\b\t\n\f\r\x1b\"\\";
    const char name = peek(1);
    at_ += 2;
    if (const std::size_t known = kNames.find(name); known != std::string_view::npos && name != '\0') {
      value += kMeant[known];
      return;
    }
    const std::size_t digits = name == 'u' ? 4 : name == 'U' ? 8 : 0;
    const std::string hex(text_.substr(std::min(at_, text_.size()), digits));
    if (digits == 0 || hex.size() < digits || hex.find_first_not_of("0123456789abcdefABCDEF") != std::string::npos)
      fail(fmt::format("\\{} is not an escape; a backslash is \\\\, or use '…'", name));
    constexpr int kHex = 16;
    append_utf8(value, static_cast<std::uint32_t>(std::stoul(hex, nullptr, kHex)));
    at_ += digits;
  }

  std::string path_;
  std::string_view text_;
  std::size_t at_ = 0;
  int line_ = 1;
  std::string section_;
  std::set<std::pair<std::string, std::string>> seen_;
  ConfigFile config_;
};

}  // namespace

ConfigFile read_toml_config(const std::string& path, std::string_view text) { return Reader(path, text).read(); }

std::string toml_string(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      quoted += std::string("\\") + c;
    else if (static_cast<unsigned char>(c) < ' ' || c == '\x7f')
      quoted += fmt::format("\\u{:04x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
    else
      quoted += c;
  }
  return quoted + '"';
}

bool is_toml_number(const std::string& text) {
  static const std::regex kNumber(R"([+-]?(inf|nan|\d(_?\d)*(\.\d(_?\d)*)?([eE][+-]?\d(_?\d)*)?))");
  return std::regex_match(text, kNumber);
}

}  // namespace pulson
