#include "xml_tags.hpp"

#include <algorithm>

#include <fmt/format.h>

#include "core/text.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::formats {
namespace {

constexpr std::string_view kXmlBlanks = " \t\r\n";

/// `text` with characters for the references that XML has names for.
std::string without_references(std::string_view text) {
  static const std::map<std::string_view, char> kNamed = {
      {"&amp;", '&'}, {"&lt;", '<'}, {"&gt;", '>'}, {"&quot;", '"'}, {"&apos;", '\''}};
  std::string plain;
  while (!text.empty()) {
    const auto found = text.front() != '&' ? kNamed.end() : kNamed.find(text.substr(0, text.find(';') + 1));
    plain += found == kNamed.end() ? text.front() : found->second;
    text.remove_prefix(found == kNamed.end() ? 1 : found->first.size());
  }
  return plain;
}

}  // namespace

std::string Tag::attribute(const std::string& key) const {
  const auto found = attributes.find(key);
  return found == attributes.end() ? std::string() : found->second;
}

bool is_xml_of(std::string_view text, std::string_view element) {
  text = text::without_byte_order_mark(text);
  text.remove_prefix(std::min(text.find_first_not_of(kXmlBlanks), text.size()));
  if (!text.starts_with('<')) return false;
  try {
    const std::string path;
    const std::optional<Tag> first = Tags(path, text).take();
    return first && first->name == element;
  } catch (const InputError&) {
    return false;
  }
}

Tags::Tags(const std::string& path, std::string_view text) : path_(path), left_(text::without_byte_order_mark(text)) {
  if (text.find('\0') != std::string_view::npos) text::split_lines(path, text);  // refuses it
  line_end_ = text::line_end_of(text);
}

std::optional<Tag> Tags::take() {
  std::optional<Tag> tag = take_any();
  if (tag) match(*tag);
  if (!tag && !open_.empty())
    text::fail(path_, open_.back().line,
               fmt::format("<{}> has no end in this file", text::as_one_line(open_.back().name)));
  return tag;
}

std::string Tags::text() const {
  const std::size_t begin = text_.find_first_not_of(kXmlBlanks);
  if (begin == std::string_view::npos) return {};
  return without_references(text_.substr(begin, text_.find_last_not_of(kXmlBlanks) - begin + 1));
}

std::optional<Tag> Tags::take_any() {
  for (;;) {
    const std::size_t begin = left_.find('<');
    text_ = left_.substr(0, begin);
    if (begin == std::string_view::npos) return std::nullopt;
    skip(begin);
    if (left_.starts_with("<!--")) {
      skip_past("-->", "a comment");
    } else if (left_.starts_with("<?")) {
      skip_past("?>", "a declaration");
    } else if (left_.starts_with("<![CDATA[")) {
      skip_past("]]>", "a text");
    } else if (left_.starts_with("<!")) {
      skip_doctype();
    } else {
      return take_tag();
    }
  }
}

void Tags::skip(std::size_t count) {
  const auto end = left_.begin() + static_cast<std::ptrdiff_t>(count);
  line_ += static_cast<std::size_t>(std::count(left_.begin(), end, line_end_));
  left_.remove_prefix(count);
}

void Tags::skip_past(std::string_view end, std::string_view what) {
  const std::size_t found = left_.find(end);
  if (found == std::string_view::npos) text::fail(path_, line_, fmt::format("{} has no '{}'", what, end));
  skip(found + end.size());
}

void Tags::skip_blanks() { skip(std::min(left_.find_first_not_of(kXmlBlanks), left_.size())); }

/// `<!DOCTYPE a>`, also with declarations between brackets.
void Tags::skip_doctype() {
  if (left_.find('[') < left_.find('>')) skip_past("]", "a declaration");
  skip_past(">", "a declaration");
}

Tag Tags::take_tag() {
  Tag tag{line_, {}, {}};
  skip(1);
  if (left_.starts_with('/')) {
    tag.begins = false;
    tag.ends = true;
    skip(1);
  }
  const std::size_t name_end = std::min(left_.find_first_of(" \t\r\n/>="), left_.size());
  tag.name = left_.substr(0, name_end);
  skip(name_end);
  for (skip_blanks(); !left_.starts_with('>') && !left_.starts_with("/>"); skip_blanks()) take_attribute(tag);
  tag.ends = tag.ends || left_.starts_with('/');
  skip_past(">", "a tag");
  return tag;
}

/// `name='00'`, with quotes of either kind
void Tags::take_attribute(Tag& tag) {
  const std::size_t equals = left_.find('=');
  const std::string_view name = left_.substr(0, std::min(left_.find_first_of(" \t\r\n=<>"), left_.size()));
  if (equals == std::string_view::npos || name.empty()) fail_attribute(tag);
  const std::size_t quote = left_.find_first_not_of(kXmlBlanks, equals + 1);
  if (left_.substr(name.size(), equals - name.size()).find_first_not_of(kXmlBlanks) != std::string_view::npos ||
      quote == std::string_view::npos || (left_[quote] != '\'' && left_[quote] != '"'))
    fail_attribute(tag);
  const std::size_t end = left_.find(left_[quote], quote + 1);
  if (end == std::string_view::npos) fail_attribute(tag);
  tag.attributes.try_emplace(std::string(name), without_references(left_.substr(quote + 1, end - quote - 1)));
  skip(end + 1);
}

void Tags::match(const Tag& tag) {
  if (tag.begins) open_.push_back({tag.line, tag.name});
  if (!tag.ends) return;
  if (open_.empty() || open_.back().name != tag.name)
    text::fail(path_, tag.line,
               fmt::format("</{}> where {} is expected", text::as_one_line(tag.name),
                           open_.empty() ? "nothing" : "</" + text::as_one_line(open_.back().name) + ">"));
  open_.pop_back();
}

void Tags::fail_attribute(const Tag& tag) const {
  if (left_.empty()) text::fail(path_, line_, fmt::format("the tag <{}> has no '>'", text::as_one_line(tag.name)));
  const std::string_view shown = left_.substr(0, std::min(left_.find_first_of("\r\n"), left_.size()));
  text::fail(
      path_, line_,
      fmt::format("{} in the tag <{}>; name='value' is expected", text::in_quotes(shown), text::as_one_line(tag.name)));
}

double coordinate_of(const Tag& tag, const text::CoordinatePlace& place) {
  const std::string key(1, text::kAxisLetters[place.axis]);
  const auto found = tag.attributes.find(key);
  if (found == tag.attributes.end())
    text::fail(place.path, tag.line,
               fmt::format("the {} {} has no {}='...'", text::as_one_line(tag.name), place.landmark, key));
  return text::parse_coordinate(text::trim(found->second), place);
}

}  // namespace pulson::formats
