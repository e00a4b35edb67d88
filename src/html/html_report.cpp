#include "html/html_report.hpp"

#include <algorithm>
#include <cctype>
#include <cerrno>
#include <cstdint>
#include <cstring>
#include <fstream>
#include <iterator>
#include <string_view>

#include <fmt/format.h>

#include "core/base64.hpp"
#include "core/colours.hpp"
#include "core/text.hpp"
#include "html_parts.hpp"
#include "html_sketch.hpp"
#include "page.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::html {

namespace {

constexpr std::string_view kPngSignature = "\x89PNG\r\n\x1a\n";
constexpr std::string_view kJpegSignature = "\xFF\xD8\xFF";
constexpr std::size_t kHeadOfSvg = 4096;  // where its first element must be found

std::string read(const std::filesystem::path& file) {
  std::error_code ignored;
  if (std::filesystem::is_directory(file, ignored))
    throw InputError(fmt::format("cannot read the picture '{}': it is a folder", file.string()));
  errno = 0;
  std::ifstream stream(file, std::ios::binary);
  std::string bytes{std::istreambuf_iterator<char>(stream), std::istreambuf_iterator<char>()};
  if (!stream) throw InputError(fmt::format("cannot read the picture '{}': {}", file.string(), std::strerror(errno)));
  return bytes;
}

}  // namespace

std::string escaped(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    const auto byte = static_cast<unsigned char>(text[i]);
    if (length == 0) {
      result += "\uFFFD";
    } else if (length > 1) {
      result += text.substr(i, length);
    } else if (byte < 0x20 || byte == 0x7F) {
      result += ' ';
    } else if (byte == '&') {
      result += "&amp;";
    } else if (byte == '<') {
      result += "&lt;";
    } else if (byte == '>') {
      result += "&gt;";
    } else if (byte == '"') {
      result += "&quot;";
    } else {
      result += text[i];
    }
    i += std::max<std::size_t>(length, 1);
  }
  return result;
}

std::string valid_utf8(std::string_view text) {
  std::string result;
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = utf8_length(text, i);
    result += length == 0 ? "\uFFFD" : text.substr(i, length);
    i += std::max<std::size_t>(length, 1);
  }
  return result;
}

namespace {

EncodedPicture read_picture(const std::filesystem::path& file) {
  std::string bytes = read(file);
  if (bytes.starts_with(kPngSignature)) return {MediaType::kPng, std::move(bytes)};
  if (bytes.starts_with(kJpegSignature)) return {MediaType::kJpeg, std::move(bytes)};
  if (std::string_view(bytes).substr(0, kHeadOfSvg).find("<svg") != std::string_view::npos)
    return {MediaType::kSvg, std::move(bytes)};
  throw InputError(fmt::format("the picture '{}' is not SVG, PNG or JPEG", file.string()));
}

std::string address_of(const EncodedPicture& picture) {
  const char* name = picture.type == MediaType::kPng ? "png" : picture.type == MediaType::kJpeg ? "jpeg" : "svg+xml";
  return fmt::format("data:image/{};base64,{}", name, base64(picture.bytes));
}

}  // namespace

std::string data_address(const EmbeddedPicture& picture) {
  if (const auto* encoded = std::get_if<EncodedPicture>(&picture)) return address_of(*encoded);
  return address_of(read_picture(std::get<std::filesystem::path>(picture)));
}

namespace {

using html::escaped;

constexpr std::size_t kLongCell = 48;  // bytes, above which the text of a cell may be broken into lines

/// A verdict has its own sign and word, so that it is not distinguished by colour only.
struct VerdictLook {
  std::string_view style, sign, words;
};

VerdictLook look_of(Verdict verdict) {
  switch (verdict) {
    case Verdict::kHolds:
      return {"holds", "✓", "holds"};
    case Verdict::kDoesNotHold:
      return {"fails", "✗", "does not hold"};
    case Verdict::kNotTested:
      break;
  }
  return {"open", "–", "not tested"};
}

bool begins_with_number(std::string_view text) {
  for (const std::string_view sign : {"−", "-", "+"})
    if (text.starts_with(sign)) text.remove_prefix(sign.size());
  return !text.empty() && std::isdigit(static_cast<unsigned char>(text.front())) != 0;
}

/// Escaped text in which names of options, such as --steps, are not broken into two lines.
std::string with_whole_options(std::string_view text) {
  const std::string plain = escaped(text);
  const auto is_letter = [&](std::size_t i) {
    return i < plain.size() && std::isalpha(static_cast<unsigned char>(plain[i]));
  };
  std::string result;
  for (std::size_t i = 0; i < plain.size();) {
    std::size_t end = i;
    if (plain.compare(i, 2, "--") == 0 && is_letter(i + 2))
      for (end = i + 2; is_letter(end) || (end < plain.size() && plain[end] == '-');) ++end;
    if (end > i) {
      result += "<span class=\"option\">" + plain.substr(i, end - i) + "</span>";
      i = end;
    } else {
      result += plain[i++];
    }
  }
  return result;
}

/// The head of a column; a short one is not broken into two lines.
std::string head_of(const std::string& text) {
  constexpr std::size_t kShort = 8;  // bytes
  if (text.size() > kShort) return escaped(text);
  std::string head;
  for (const char c : escaped(text)) head += c == ' ' ? "&nbsp;" : c == '-' ? "&#8209;" : std::string(1, c);
  return head;
}

/// Writes the blocks of a section.
class BlockWriter {
 public:
  explicit BlockWriter(std::string& page) : page_(page) {}

  void operator()(const ReportParagraph& paragraph) { page_ += "<p>" + with_whole_options(paragraph.text) + "</p>\n"; }

  void operator()(const ReportPicture& picture) {
    const std::string begin = picture.narrow
                                  ? fmt::format("<picture><source media=\"(max-width: 44rem)\" srcset=\"{}\">\n",
                                                html::data_address(*picture.narrow))
                                  : std::string();
    // What scrolls on narrow screens has to be reached by the keyboard.
    page_ += fmt::format(
        "<figure>\n<div class=\"still{}\" tabindex=\"0\" role=\"region\" aria-label=\"picture\">\n"
        "{}<img src=\"{}\" alt=\"{}\">{}\n</div>\n",
        picture.has_photograph ? "" : " drawing", begin, html::data_address(picture.picture), escaped(picture.caption),
        picture.narrow ? "</picture>" : "");
    if (!picture.caption.empty()) page_ += "<figcaption>" + escaped(picture.caption) + "</figcaption>\n";
    page_ += "</figure>\n";
  }

  void operator()(const ReportTable& table) {
    for (std::size_t r = 0; r < table.rows.size(); ++r)
      if (table.rows[r].size() != table.header.size())
        throw InputError(fmt::format("report: row {} of a table has {} cells for {} heads", r + 1, table.rows[r].size(),
                                     table.header.size()));
    page_ += table.has_facts ? "<figure class=\"facts\">\n" : "<figure>\n";
    if (!table.caption.empty()) page_ += "<figcaption class=\"above\">" + escaped(table.caption) + "</figcaption>\n";
    // What scrolls has to be reached by the keyboard.
    constexpr std::size_t kLongTable = 20;  // rows, from which on it scrolls in a box of its own
    page_ +=
        fmt::format("<div class=\"box{}\" tabindex=\"0\" role=\"region\" aria-label=\"{}\">\n<table>\n<thead>\n<tr>",
                    table.rows.size() > kLongTable && !table.has_facts ? " tall" : "",
                    table.caption.empty() ? "table" : escaped(table.caption));
    std::vector<bool> numeric;
    for (std::size_t c = 0; c < table.header.size(); ++c) {
      numeric.push_back(is_numeric(table, c));
      const std::string head = head_of(table.header[c]);
      page_ += fmt::format(R"(<th scope="col"{}>{}</th>)", numeric[c] ? R"( class="number")" : "",
                           table.has_facts ? head : "<button type=\"button\">" + head + "</button>");
    }
    page_ += "</tr>\n</thead>\n<tbody>\n";
    for (const std::vector<ReportCell>& row : table.rows) {
      page_ += "<tr>";
      for (std::size_t c = 0; c < row.size(); ++c) cell(row[c], numeric[c]);
      page_ += "</tr>\n";
    }
    page_ += "</tbody>\n</table>\n</div>\n</figure>\n";
  }

  void operator()(const ReportMotion& motion) { page_ += html::motion(motion); }
  void operator()(const ReportStack& stack) { page_ += html::stack(stack); }
  void operator()(const ReportShapeSpace& space) { page_ += html::shape_space(space); }

  void operator()(const ReportClaims& claims) {
    if (claims.empty()) return;
    page_ += "<ul class=\"claims\">\n";
    for (const ReportClaim& claim : claims) {
      const VerdictLook look = look_of(claim.verdict);
      page_ += fmt::format(R"(<li><span class="verdict {}">{} {}</span><span class="claim">{}</span>)", look.style,
                           look.sign, look.words, escaped(claim.claim));
      if (!claim.measured.empty()) page_ += R"(<span class="measured">)" + escaped(claim.measured) + "</span>";
      page_ += "</li>\n";
    }
    page_ += "</ul>\n";
  }

 private:
  static bool is_numeric(const ReportTable& table, std::size_t column) {
    const auto all = [&](const auto& holds) { return std::all_of(table.rows.begin(), table.rows.end(), holds); };
    const auto is_empty = [](const std::string& text) { return text.empty() || text == "–"; };
    return !all([&](const auto& row) { return is_empty(row[column].text); }) &&
           all([&](const auto& row) { return is_empty(row[column].text) || begins_with_number(row[column].text); });
  }

  void cell(const ReportCell& cell, bool numeric) {
    page_ += numeric ? R"(<td class="number">)" : cell.text.size() > kLongCell ? R"(<td class="long">)" : "<td>";
    if (cell.verdict) {
      const VerdictLook look = look_of(*cell.verdict);
      page_ += fmt::format(R"(<span class="verdict {}" role="img" aria-label="{}">{}</span>)", look.style, look.words,
                           look.sign);
    }
    if (cell.sketch) page_ += html::sketch(*cell.sketch);
    if (cell.outlier) page_ += R"(<span class="outlier" role="img" aria-label="outlier">▲</span>)";
    page_ += escaped(cell.text) + "</td>";
  }

  std::string& page_;
};

template <class Block>
bool has(const HtmlReport& report) {
  return std::any_of(report.sections.begin(), report.sections.end(), [](const ReportSection& section) {
    return std::any_of(section.blocks.begin(), section.blocks.end(),
                       [](const ReportBlock& block) { return std::holds_alternative<Block>(block); });
  });
}

std::string footer(const HtmlReport& report) {
  if (report.command.empty() && report.version.empty()) return "";
  std::string text = "<footer>\n<div>\n";
  if (!report.command.empty()) text += "<p>Made by</p>\n<pre><code>" + escaped(report.command) + "</code></pre>\n";
  if (!report.version.empty()) text += "<p>" + escaped(report.version) + "</p>\n";
  return text + "</div>\n</footer>\n";
}

std::string colours_of(const Palette& palette) {
  constexpr std::string_view kVariable = "--";  // begins the names of those of CSS
  return fmt::format(":root {{ {0}goal: {1}; {0}first: {2}; {0}groups: {3}; }}", kVariable, palette.target,
                     palette.groups.front(), fmt::join(palette.groups, " "));
}

/// The style of motions, with the colours that pictures have.
std::string motion_style() {
  return fmt::format("{}\n@media (prefers-color-scheme: dark) {{ {} }}\n{}", colours_of(kLightPalette),
                     colours_of(kDarkPalette), page::motion_css);
}

/// What the page needs of the scripts, each a line of its own.
std::string scripts_of(const HtmlReport& report) {
  const bool has_space = has<ReportShapeSpace>(report), stacks = has<ReportStack>(report);
  const bool moves = has<ReportMotion>(report) || has_space;
  std::string text = fmt::format("\n{}", page::report_js);
  if (moves || stacks) text += fmt::format("\n{}", page::zoom_js);
  if (moves) text += fmt::format("\n{}\n{}", page::view_js, page::motion_js);
  if (has_space) text += fmt::format("\n{}", page::space_js);
  if (stacks) text += fmt::format("\n{}", page::stack_js);
  return text;
}

std::string styles_of(const HtmlReport& report) {
  const bool moves = has<ReportMotion>(report) || has<ReportStack>(report) || has<ReportShapeSpace>(report);
  return fmt::format("\n{}{}{}", page::report_css, moves ? "\n" : "", moves ? motion_style() : "");
}

}  // namespace

namespace {

/// Long names of files may be broken behind an underscore, a hyphen or a slash.
std::string breakable(const std::string& text) {
  std::string result;
  for (const char letter : text) {
    result += letter;
    if (letter == '_' || letter == '-' || letter == '/') result += "<wbr>";
  }
  return result;
}

}  // namespace

std::string html_report(const HtmlReport& report) {
  std::string page = fmt::format(
      "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n"
      "<meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n"
      "<title>{}</title>\n<style>{}</style>\n</head>\n<body>\n<main>\n<h1>{}</h1>\n",
      escaped(report.title), styles_of(report), breakable(escaped(report.title)));
  if (!report.lead.empty()) page += "<p class=\"lead\">" + escaped(report.lead) + "</p>\n";
  for (const ReportSection& section : report.sections) {
    page += "<section>\n";
    if (!section.heading.empty()) page += "<h2>" + escaped(section.heading) + "</h2>\n";
    for (const ReportBlock& block : section.blocks) std::visit(BlockWriter(page), block);
    page += "</section>\n";
  }
  page += "</main>\n" + footer(report);
  return page + fmt::format("<script>{}</script>\n</body>\n</html>\n", scripts_of(report));
}

}  // namespace pulson::html
