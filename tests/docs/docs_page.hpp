#pragma once

#include <cmath>
#include <cstddef>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

namespace pulson {

/// A command of a page of documentation.
struct PageCommand {
  std::size_t line = 0;                 ///< of the page, from 1
  std::string command;                  ///< what stands after `$ `, continued lines joined
  std::vector<std::string> shown{};     ///< the output that the page shows
  int exit_code = 0;                    ///< that it must end with: 2 where the page shows an error
  bool shortened = false;               ///< tests run it with other numbers, so its output is not compared
  std::vector<std::string> needs{};     ///< files of the real data that it reads
  std::vector<std::string> programs{};  ///< that need not be installed
};

/// A picture that a page's commands write.
struct PageImage {
  std::string name;         ///< in docs/images
  std::string file;         ///< where the commands leave it
  std::size_t command = 0;  ///< place among the page's commands of the last one before
};

/// The commands of a page of Markdown: the lines that begin with `$ ` in blocks of ```console. A comment before a block
/// says how tests run it, in parts that `;` separates:
///
///     <!-- in tests: --samples 50000 as --samples 500; needs insects/wing.jpg; program ffmpeg; exit 3 -->
///
/// A comment after a block names pictures of docs/images that its commands write:
///
///     <!-- images: fish.png = fish/registration.png, hand.png = hand/registration.png -->
///
/// A comment before another block names a file of that content, which the commands use:
///
///     <!-- file: replay.py -->
struct Page {
  std::vector<PageCommand> commands;
  std::vector<PageImage> images{};
  std::map<std::string, std::string> files{};  ///< contents by name
  std::vector<std::size_t> strays;  ///< lines with a command of ours in another block, which no test would run
};

namespace page_detail {

struct Setting {
  std::vector<std::pair<std::string, std::string>> replaced;
  std::vector<std::string> needs;
  std::vector<std::string> programs;
  int exit_code = 0;
};

inline std::string trimmed(const std::string& text) {
  const std::size_t begin = text.find_first_not_of(" \t");
  return begin == std::string::npos ? "" : text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

inline Setting setting_of(const std::string& text) {
  Setting setting;
  std::istringstream parts(text);
  for (std::string part; std::getline(parts, part, ';');) {
    part = trimmed(part);
    if (part.rfind("needs ", 0) == 0) {
      std::istringstream names(part.substr(6));
      for (std::string name; names >> name;) setting.needs.push_back(name);
    } else if (part.rfind("program ", 0) == 0) {
      setting.programs.push_back(part.substr(8));
    } else if (part.rfind("exit ", 0) == 0) {
      setting.exit_code = std::stoi(part.substr(5));
    } else if (const std::size_t as = part.find(" as "); as != std::string::npos) {
      setting.replaced.emplace_back(part.substr(0, as), part.substr(as + 4));
    }
  }
  return setting;
}

inline void apply(const Setting& setting, PageCommand& command) {
  command.needs = setting.needs;
  command.programs = setting.programs;
  for (const auto& [from, to] : setting.replaced)
    for (std::size_t at = command.command.find(from); at != std::string::npos;
         at = command.command.find(from, at + to.size())) {
      command.command.replace(at, from.size(), to);
      command.shortened = true;
    }
  command.exit_code = setting.exit_code;
  for (const std::string& shown : command.shown)
    if (shown.rfind("pulson: ", 0) == 0) command.exit_code = 2;
}

inline bool is_digit(char c) { return c >= '0' && c <= '9'; }

/// The end of the number that begins at `i`: digits, then a fraction, then an exponent.
inline std::size_t end_of_number(const std::string& line, std::size_t i) {
  const auto skip_digits = [&](std::size_t from) {
    while (from < line.size() && is_digit(line[from])) ++from;
    return from;
  };
  i = skip_digits(i);
  if (i < line.size() && line[i] == '.') i = skip_digits(i + 1);
  if (i + 1 < line.size() && line[i] == 'e') {
    const std::size_t digits = i + (line[i + 1] == '-' || line[i + 1] == '+' ? 2 : 1);
    if (digits < line.size() && is_digit(line[digits])) i = skip_digits(digits);
  }
  return i;
}

/// Numbers, `…`, and what stands between these and blanks.
inline std::vector<std::string> tokens(const std::string& line) {
  const std::string gap = "…";
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < line.size();) {
    const std::size_t begin = i;
    if (line[i] == ' ' || line[i] == '\t') {
      ++i;
      continue;
    }
    if (line.compare(i, gap.size(), gap) == 0) {
      i += gap.size();
    } else if (is_digit(line[i])) {
      i = end_of_number(line, i);
    } else {
      while (i < line.size() && line[i] != ' ' && line[i] != '\t' && !is_digit(line[i]) &&
             line.compare(i, gap.size(), gap) != 0)
        ++i;
    }
    parts.push_back(line.substr(begin, i - begin));
  }
  return parts;
}

inline bool is_number(const std::string& token) { return is_digit(token.front()); }

/// Whether a line is a command of ours: `pulson VERB …`, after `$ ` or not, with a folder before it or not.
inline bool is_command(const std::string& line) {
  std::string text = trimmed(line);
  if (text.rfind("$ ", 0) == 0) text = trimmed(text.substr(2));
  const std::size_t end = text.find(' ');
  if (end == std::string::npos || end + 1 >= text.size() || text[end + 1] < 'a' || text[end + 1] > 'z') return false;
  const std::string program = text.substr(0, end);
  return program.substr(program.rfind('/') + 1) == "pulson";
}

inline constexpr double kRounding = 1e-14;  // numbers below it are what rounding left, other in every build

inline bool match_from(const std::vector<std::string>& shown, std::size_t s, const std::vector<std::string>& real,
                       std::size_t r) {
  if (s == shown.size()) return r == real.size();
  if (shown[s] == "…") {
    for (std::size_t next = r; next <= real.size(); ++next)
      if (match_from(shown, s + 1, real, next)) return true;
    return false;
  }
  if (r == real.size()) return false;
  if (is_number(shown[s]) && is_number(real[r])) {
    const double a = std::stod(shown[s]), b = std::stod(real[r]);
    const bool is_rounding = std::max(std::abs(a), std::abs(b)) < kRounding;
    if (!is_rounding && !(std::abs(a - b) <= 0.02 * std::abs(a))) return false;
  } else if (shown[s] != real[r]) {
    return false;
  }
  return match_from(shown, s + 1, real, r + 1);
}

}  // namespace page_detail

/// Whether a shown line is a line of real output: the same words, numbers within 2 % (processors differ in the last
/// digits) or both of the size of rounding, and `…` for anything.
inline bool lines_agree(const std::string& shown, const std::string& real) {
  return page_detail::match_from(page_detail::tokens(shown), 0, page_detail::tokens(real), 0);
}

namespace page_detail {

inline void add_images(const std::string& list, Page& page) {
  std::istringstream parts(list);
  for (std::string part; std::getline(parts, part, ',');)
    if (const std::size_t is = part.find('='); is != std::string::npos && !page.commands.empty())
      page.images.push_back({trimmed(part.substr(0, is)), trimmed(part.substr(is + 1)), page.commands.size() - 1});
}

}  // namespace page_detail

/// `in_full`: the commands whose pictures are named run as a reader runs them, the others as tests do.
inline Page read_page(const std::string& text, bool in_full = false) {
  using namespace page_detail;
  Page page;
  Setting setting;
  bool in_console = false, in_other = false, continues = false;
  std::string file;  // that the next block is
  std::size_t number = 0;
  std::size_t first = 0;           // of the commands in this block
  std::vector<std::string> whole;  // these commands, as they stand
  std::istringstream lines(text);
  for (std::string line; std::getline(lines, line);) {
    ++number;
    if (line.rfind("```", 0) == 0) {
      if (in_console) {
        whole.clear();
        for (std::size_t i = first; i < page.commands.size(); ++i) {
          whole.push_back(page.commands[i].command);
          apply(setting, page.commands[i]);
        }
      }
      if (in_console || in_other) {
        in_console = in_other = false;
        setting = {};
        file.clear();
      } else {
        in_console = line == "```console";
        in_other = !in_console;
        if (in_console) first = page.commands.size();
      }
    } else if (in_other && !file.empty()) {
      page.files[file] += line + "\n";
    } else if (in_console && continues) {
      page.commands.back().command += "\n" + line;
    } else if (in_console && line.rfind("$ ", 0) == 0) {
      page.commands.push_back({number, line.substr(2)});
    } else if (in_console && !page.commands.empty()) {
      if (!trimmed(line).empty()) page.commands.back().shown.push_back(line);
    } else if (line.rfind("<!-- in tests: ", 0) == 0) {
      setting = setting_of(line.substr(15, line.rfind("-->") - 15));
    } else if (line.rfind("<!-- file: ", 0) == 0) {
      file = trimmed(line.substr(11, line.rfind("-->") - 11));
    } else if (line.rfind("<!-- images: ", 0) == 0) {
      add_images(line.substr(13, line.rfind("-->") - 13), page);
      for (std::size_t i = 0; in_full && i < whole.size(); ++i) {
        page.commands[first + i].command = whole[i];
        page.commands[first + i].shortened = false;
      }
    } else if ((in_other || line.rfind("    ", 0) == 0) && is_command(line)) {
      page.strays.push_back(number);
    }
    continues = in_console && !line.empty() && line.back() == '\\' && (continues || line.rfind("$ ", 0) == 0);
  }
  return page;
}

}  // namespace pulson
