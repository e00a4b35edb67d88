#include "core/name_matching.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <map>
#include <optional>
#include <set>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "core/first_names.hpp"
#include "core/text.hpp"
#include "pulson/core/name_table.hpp"

namespace pulson {

int NameMatch::matched() const {
  return static_cast<int>(std::count_if(partners.begin(), partners.end(), [](int partner) { return partner >= 0; }));
}

std::vector<int> NameMatch::unmatched() const {
  std::vector<int> lonely;
  for (std::size_t i = 0; i < partners.size(); ++i)
    if (partners[i] < 0) lonely.push_back(static_cast<int>(i));
  return lonely;
}

std::vector<int> NameMatch::spare(int count) const {
  const std::set<int> taken(partners.begin(), partners.end());
  std::vector<int> left;
  for (int i = 0; i < count; ++i)
    if (!taken.contains(i)) left.push_back(i);
  return left;
}

std::string listed_names(const std::vector<std::string>& names) {
  std::string text;
  for (const std::string& name : names) text += (text.empty() ? "" : ", ") + quoted_line(name);
  return text;
}

namespace {

// ---- what is ignored

struct Difference {
  unsigned bit;
  std::string_view words;
};

constexpr unsigned kPath = 1, kCase = 2, kZeros = 4, kSeparators = 8;
constexpr unsigned kAll = kPath | kCase | kZeros | kSeparators;
constexpr std::array<Difference, 4> kDifferences = {
    {{kCase, "case"}, {kSeparators, "blanks, _ and -"}, {kZeros, "leading zeros"}, {kPath, "folders and extensions"}}};

// Of files that are named after specimens. Other endings, as in `Acer.rubrum`, are part of a name.
constexpr std::string_view kExtensions =
    " jpg jpeg png tif tiff bmp gif webp dcm nrrd nhdr mha mhd nii gz tps nts dta csv tsv txt json mrk fcsv pts xml "
    "npy "
    "ply obj stl vtk vtp ";

std::string_view without_path(std::string_view name) {
  if (const std::size_t slash = name.find_last_of("/\\"); slash != std::string_view::npos && slash + 1 < name.size())
    name.remove_prefix(slash + 1);
  for (;;) {
    const std::size_t dot = name.rfind('.');
    if (dot == std::string_view::npos || dot == 0) return name;
    const std::string ending = " " + text::to_lower(name.substr(dot + 1)) + " ";
    if (kExtensions.find(ending) == std::string_view::npos) return name;
    name = name.substr(0, dot);
  }
}

bool is_digit_at(std::string_view text, std::size_t i) { return i < text.size() && text::is_digit(text[i]); }

// Zeros behind a decimal point are none: 1.05.
std::string without_leading_zeros(std::string_view name) {
  std::string text;
  for (std::size_t i = 0; i < name.size(); ++i) {
    const bool begins_number = name[i] == '0' && (text.empty() || !text::is_digit(text.back()));
    const bool is_decimal = text.size() > 1 && text.back() == '.' && text::is_digit(text[text.size() - 2]);
    if (begins_number && !is_decimal && is_digit_at(name, i + 1)) continue;
    text += name[i];
  }
  return text;
}

bool is_separator(char c) { return c == '_' || c == '-' || c == ' ' || c == '\t' || c == '\n' || c == '\r'; }

// One `-` stays between two numbers: 1-11 is not 11-1.
std::string without_separators(std::string_view name) {
  std::string text;
  bool is_parted = false;
  for (const char c : name) {
    if (is_separator(c)) {
      is_parted = true;
      continue;
    }
    if (is_parted && !text.empty() && text::is_digit(text.back()) && text::is_digit(c)) text += '-';
    is_parted = false;
    text += c;
  }
  return text;
}

std::string plain_key(std::string_view name, unsigned ignored) {
  std::string key(ignored & kPath ? without_path(name) : name);
  if (ignored & kCase) key = text::to_lower(key);
  if (ignored & kZeros) key = without_leading_zeros(key);
  return ignored & kSeparators ? without_separators(key) : key;
}

using Keys = std::vector<std::string>;

Keys plain_keys(const NameList& list, unsigned ignored) {
  Keys keys;
  keys.reserve(list.names.size());
  for (const std::string& name : list.names) keys.push_back(plain_key(name, ignored));
  return keys;
}

// ---- what all names of a file share

struct Affixes {
  std::string prefix, suffix;
};

std::size_t common_length(std::string_view a, std::string_view b) {
  return static_cast<std::size_t>(std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first - a.begin());
}

// The beginning that all share, cut back so that it ends neither within a number nor within a character of UTF-8.
std::string common_prefix(const Keys& keys) {
  std::string_view common = keys.front();
  for (const std::string& key : keys) common = common.substr(0, common_length(common, key));
  const auto cuts = [&](const std::string& key) {
    const std::size_t end = common.size();
    if (end >= key.size()) return false;
    return !begins_character(key[end]) || (text::is_digit(common.back()) && text::is_digit(key[end]));
  };
  while (!common.empty() && std::any_of(keys.begin(), keys.end(), cuts)) common.remove_suffix(1);
  return std::string(common);
}

Keys reversed(Keys keys) {
  for (std::string& key : keys) std::reverse(key.begin(), key.end());
  return keys;
}

// The end that all share, likewise.
std::string common_suffix(const Keys& keys) {
  const Keys backwards = reversed(keys);
  std::string_view common = backwards.front();
  for (const std::string& key : backwards) common = common.substr(0, common_length(common, key));
  const auto cuts = [&](const std::string& key) {
    const std::size_t end = common.size();
    return !begins_character(common.back()) || (text::is_digit(common.back()) && is_digit_at(key, end));
  };
  while (!common.empty() && std::any_of(backwards.begin(), backwards.end(), cuts)) common.remove_suffix(1);
  return {common.rbegin(), common.rend()};
}

enum Left : unsigned { kNothing = 0, kPrefix = 1, kSuffix = 2, kBoth = 3 };

// Without the affixes; empty where nothing of some name would remain.
Keys stripped(const Keys& keys, const Affixes& shared, unsigned left) {
  const std::size_t before = left & kPrefix ? shared.prefix.size() : 0,
                    after = left & kSuffix ? shared.suffix.size() : 0;
  Keys rest;
  for (const std::string& key : keys) {
    if (key.size() <= before + after) return {};
    rest.push_back(key.substr(before, key.size() - before - after));
  }
  return rest;
}

Affixes affixes_of(const Keys& keys) {
  if (keys.size() < 2) return {};
  return {common_prefix(keys), common_suffix(keys)};
}

bool are_numbers(const Keys& keys) {
  const auto is_whole = [](const std::string& key) {
    constexpr std::size_t kMostDigits = 9;  // of an int
    return !key.empty() && key.size() <= kMostDigits && std::all_of(key.begin(), key.end(), text::is_digit);
  };
  return !keys.empty() && std::all_of(keys.begin(), keys.end(), is_whole);
}

std::set<int> values_of(const Keys& numbers) {
  std::set<int> values;
  for (const std::string& number : numbers) values.insert(std::stoi(number));
  return values;
}

// ---- pairs

using Groups = std::map<std::string_view, std::vector<int>>;

Groups groups_by_key(const Keys& keys) {
  Groups groups;
  for (std::size_t i = 0; i < keys.size(); ++i)
    if (!keys[i].empty()) groups[keys[i]].push_back(static_cast<int>(i));
  return groups;
}

class Matcher {
 public:
  Matcher(const NameList& first, const NameList& other, NameKind kind)
      : first_(first), other_(other), kind_(kind), taken_(other.names.size()) {
    match_.partners.assign(first.names.size(), -1);
  }

  NameMatch find() && {
    const Keys plain_first = plain_keys(first_, kAll), plain_other = plain_keys(other_, kAll);
    match_.exact = pair_by(first_.names, other_.names);
    match_.plain = match_.exact + pair_by(plain_first, plain_other);
    const Affixes of_first = affixes_of(plain_first), of_other = affixes_of(plain_other);
    if (match_.plain < std::ssize(first_.names) && !plain_first.empty() && !plain_other.empty())
      pair_without_affixes(plain_first, of_first, plain_other, of_other);
    check_counts(stripped(plain_first, of_first, kBoth), stripped(plain_other, of_other, kBoth));
    if (match_.problem.empty() && match_.matched() > match_.exact) match_.note = note();
    return std::move(match_);
  }

 private:
  bool is_free(int a) const { return match_.partners[static_cast<std::size_t>(a)] < 0; }
  bool is_other_free(int b) const { return !taken_[static_cast<std::size_t>(b)]; }

  // Pairs names that still lack a partner where no third has their key. @return how many
  int pair_by(const Keys& keys, const Keys& other_keys) {
    const Groups of_other = groups_by_key(other_keys);
    int found = 0;
    for (const auto& [key, mine] : groups_by_key(keys)) {
      const auto theirs = of_other.find(key);
      if (theirs == of_other.end() || std::none_of(mine.begin(), mine.end(), [&](int a) { return is_free(a); }) ||
          std::none_of(theirs->second.begin(), theirs->second.end(), [&](int b) { return is_other_free(b); }))
        continue;
      if (mine.size() > 1 || theirs->second.size() > 1) {
        if (match_.problem.empty()) match_.problem = alike(mine, theirs->second);
        continue;
      }
      match_.partners[static_cast<std::size_t>(mine.front())] = theirs->second.front();
      taken_[static_cast<std::size_t>(theirs->second.front())] = true;
      ++found;
    }
    return found;
  }

  // How many more pairs these keys would make.
  int gain(const Keys& keys, const Keys& other_keys) const {
    if (keys.empty() || other_keys.empty()) return 0;
    Matcher trial = *this;
    return trial.pair_by(keys, other_keys);
  }

  // Numbers that all names share may be what distinguishes these from others: `1-11` is not `11-1`.
  static bool has_word(const Affixes& shared) {
    const std::string text = shared.prefix + shared.suffix;
    return std::any_of(text.begin(), text.end(), [](unsigned char c) { return std::isalpha(c) != 0 || c >= 0x80U; });
  }

  void pair_without_affixes(const Keys& keys, const Affixes& mine, const Keys& other_keys, const Affixes& theirs) {
    int best = 0;
    Keys best_keys, best_others;
    const auto try_pair = [&](unsigned left, unsigned left_other) {
      Keys rest = stripped(keys, mine, left), other_rest = stripped(other_keys, theirs, left_other);
      const bool in_both = left != kNothing && left_other != kNothing;
      if (in_both && !(kind_ == NameKind::kLandmarks && has_word(mine) && has_word(theirs) && are_numbers(rest) &&
                       are_numbers(other_rest)))
        return;
      const int pairs = gain(rest, other_rest);
      if (pairs <= best) return;
      best = pairs;
      left_ = left;
      left_other_ = left_other;
      best_keys = std::move(rest);
      best_others = std::move(other_rest);
    };
    for (const unsigned left : {kPrefix, kSuffix, kBoth}) try_pair(left, kNothing);
    for (const unsigned left : {kPrefix, kSuffix, kBoth}) try_pair(kNothing, left);
    for (const unsigned left : {kPrefix, kSuffix, kBoth})
      for (const unsigned left_other : {kPrefix, kSuffix, kBoth}) try_pair(left, left_other);
    if (best == 0) return;
    shared_ = mine;
    shared_other_ = theirs;
    pair_by(best_keys, best_others);
  }

  std::string names_at(const NameList& list, const std::vector<int>& places) const {
    std::vector<std::string> names;
    for (const int i : places) names.push_back(list.names[static_cast<std::size_t>(i)]);
    return listed_names(names);
  }

  std::string alike(const std::vector<int>& mine, const std::vector<int>& theirs) const {
    const bool in_first = mine.size() > 1;
    const NameList& list = in_first ? first_ : other_;
    const std::vector<int>& places = in_first ? mine : theirs;
    return fmt::format("{}: the names {} are alike, and {} of {} has to match one of them: give each another name",
                       list.source, names_at(list, places),
                       names_at(in_first ? other_ : first_, in_first ? theirs : mine),
                       in_first ? other_.source : first_.source);
  }

  /// One file may count from 0 where the other counts from 1: then equal numbers are not the same, unless each of the
  /// specimens has its row.
  void check_counts(const Keys& numbers, const Keys& other_numbers) {
    if (!are_numbers(numbers) || !are_numbers(other_numbers)) return;
    const std::set<int> mine = values_of(numbers), theirs = values_of(other_numbers);
    if ((*mine.begin() == 0) == (*theirs.begin() == 0)) return;
    if (kind_ == NameKind::kSpecimens && match_.matched() == std::ssize(first_.names)) return;
    const bool first_is_lower = *mine.begin() == 0;
    const std::set<int>& from_zero = first_is_lower ? mine : theirs;
    const std::set<int>& from_one = first_is_lower ? theirs : mine;
    const auto equal = std::count_if(from_one.begin(), from_one.end(), [&](int k) { return from_zero.contains(k); });
    const auto next = std::count_if(from_one.begin(), from_one.end(), [&](int k) { return from_zero.contains(k - 1); });
    if (next < equal || next == 0) return;
    match_.problem = fmt::format(
        "{} numbers {} from 0 to {}, {} from {} to {}: either {} of the one is {} of the other, or equal numbers are "
        "the "
        "same and 0 has no partner; number both alike",
        (first_is_lower ? first_ : other_).source, kind_ == NameKind::kLandmarks ? "landmarks" : "specimens",
        *from_zero.rbegin(), (first_is_lower ? other_ : first_).source, *from_one.begin(), *from_one.rbegin(),
        *from_one.begin() - 1, *from_one.begin());
  }

  // ---- the note

  bool differ(std::size_t a, unsigned ignored) const {
    const auto b = static_cast<std::size_t>(match_.partners[a]);
    return plain_key(first_.names[a], ignored) != plain_key(other_.names[b], ignored);
  }

  // Those that some pair needs: without ignoring them its names differ more than with it.
  std::vector<std::string> ignored_words(const std::vector<std::size_t>& pairs) const {
    std::vector<std::string> words;
    for (const Difference& difference : kDifferences) {
      const auto needs = [&](std::size_t a) {
        return differ(a, kAll & ~difference.bit) && (!differ(a, kAll) || differs_by(a, difference.bit));
      };
      if (std::any_of(pairs.begin(), pairs.end(), needs)) words.emplace_back(difference.words);
    }
    return words;
  }

  // Whether this step changes one of the two names, where they are alike without what their files share.
  bool differs_by(std::size_t a, unsigned bit) const {
    const auto b = static_cast<std::size_t>(match_.partners[a]);
    const auto changes = [bit](const std::string& name) { return plain_key(name, bit) != name; };
    return changes(first_.names[a]) != changes(other_.names[b]);
  }

  static std::string affix_words(const NameList& list, const Affixes& shared, unsigned left) {
    std::vector<std::string> parts;
    if ((left & kPrefix) != 0 && !shared.prefix.empty())
      parts.push_back(quoted_line(shared.prefix) + " at the beginning");
    if ((left & kSuffix) != 0 && !shared.suffix.empty()) parts.push_back(quoted_line(shared.suffix) + " at the end");
    return parts.empty() ? "" : fmt::format("{} of all names of {}", fmt::join(parts, " and "), list.source);
  }

  std::string note() const {
    std::vector<std::size_t> pairs;
    for (std::size_t a = 0; a < match_.partners.size(); ++a)
      if (!is_free(static_cast<int>(a)) &&
          first_.names[a] != other_.names[static_cast<std::size_t>(match_.partners[a])])
        pairs.push_back(a);
    std::vector<std::string> ignored = ignored_words(pairs);
    for (std::string words : {affix_words(first_, shared_, left_), affix_words(other_, shared_other_, left_other_)})
      if (!words.empty()) ignored.push_back(std::move(words));
    constexpr std::size_t kShown = 20;
    std::vector<std::string> shown;
    for (const std::size_t pair : pairs)
      shown.push_back(fmt::format("{} with {}", quoted_line(first_.names[pair]),
                                  quoted_line(other_.names[static_cast<std::size_t>(match_.partners[pair])])));
    return fmt::format("{} and {}: names matched after ignoring {}: {}", first_.source, other_.source,
                       fmt::join(ignored, "; "), text::first_of(std::move(shown), kShown));
  }

  const NameList& first_;
  const NameList& other_;
  NameKind kind_;
  NameMatch match_;
  std::vector<bool> taken_;
  Affixes shared_, shared_other_;
  unsigned left_ = kNothing, left_other_ = kNothing;
};

}  // namespace

NameMatch match_names(const NameList& first, const NameList& other, NameKind kind) {
  return Matcher(first, other, kind).find();
}

std::vector<std::string> numbers_for(const NameList& other, int count) {
  const Keys keys = plain_keys(other, kAll);
  if (keys.empty()) return {};
  const Keys rest = stripped(keys, affixes_of(keys), kBoth);
  const Keys& numbers = are_numbers(keys) ? keys : rest;
  if (!are_numbers(numbers)) return {};
  const std::set<int> values = values_of(numbers);
  const int least = *values.begin(), most = *values.rbegin();
  const bool counts_all = least <= 1 && most - least + 1 == std::ssize(values);
  if (counts_all ? std::ssize(values) != count : least == 0 || most > count) return {};
  const int begin = counts_all ? least : 1;
  std::vector<std::string> names;
  for (int k = 0; k < count; ++k) names.push_back(fmt::to_string(begin + k));
  return names;
}

}  // namespace pulson
