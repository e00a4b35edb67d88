#pragma once

// The one matcher of names: of landmarks, specimens, rows of tables and tips of trees.

#include <string>
#include <vector>

namespace pulson {

/// What names are of; messages call them so.
enum class NameKind : unsigned char { kLandmarks, kSpecimens };

/// The names of one file. An empty one matches nothing.
struct NameList {
  std::string source;  ///< what messages call the file
  std::vector<std::string> names;
};

/// Which names of two files mean the same.
struct NameMatch {
  std::vector<int> partners;  ///< of each name of the first file, its place in the other, from 0; −1: none
  int exact = 0;              ///< pairs of equal names
  int plain = 0;              ///< pairs of names that are alike without leaving out what all of a file share
  std::string note;           ///< what was ignored, and the names that match only so; empty: they are all equal
  /// Why the names do not say which correspond: some are alike, or one file counts from 0 and the other from 1. Empty:
  /// they do. Partners that are set beside it are not to be used.
  std::string problem;

  /// How many of the first have a partner.
  int matched() const;
  /// Those of the first without a partner, and of the other's `count`, from 0.
  std::vector<int> unmatched() const;
  std::vector<int> spare(int count) const;
};

/// Pairs names one to one: equal ones first; of the others those that are equal
///
///  1. without differences in case, blanks, `_` and `-`, leading zeros of whole numbers, folders and the extension of a
///     picture's or table's file,
///  2. and, where the first step leaves some, without the beginning or the end that all names of one file share, as in
///     `LM1` … `LM9` and `1` … `9`. What all names share never ends within a number. It is left out of one file only,
///     but of both where what remains in both are numbers, of landmarks: `F-1`, `F-2` and `skull-1`, `skull-2`.
///
/// Names that are alike in one file by these rules have no partner by them, and are a problem where the other file has
/// such a name, too. Costs O(names · length · log names).
NameMatch match_names(const NameList& first, const NameList& other, NameKind kind);

/// Numbers by which `count` landmarks without names match the names of `other`: from 0 where these count from 0, else
/// from 1. Empty where the names of `other` are no numbers, some are larger than `count`, or they count 1, 2, … to
/// another end.
std::vector<std::string> numbers_for(const NameList& other, int count);

/// Names in quotes with commas between, all of them.
std::string listed_names(const std::vector<std::string>& names);

}  // namespace pulson
