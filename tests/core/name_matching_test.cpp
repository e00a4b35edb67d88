// The one matcher of names: what it takes for the same, what it never does, and what it says of it.

#include "core/name_matching.hpp"

#include <algorithm>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pulson {
namespace {

using testing::AllOf;
using testing::Each;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;
using testing::Not;

using Texts = std::vector<std::string>;

NameMatch matched(const Texts& first, const Texts& other, NameKind kind = NameKind::kLandmarks) {
  return match_names({"a.csv", first}, {"b.csv", other}, kind);
}

TEST(NameMatching, TakesEqualNamesFirst) {
  const NameMatch match = matched({"nose", "Nose", "tail"}, {"Nose", "tail", "nose"});
  EXPECT_THAT(match.partners, ElementsAre(2, 0, 1));
  EXPECT_THAT(match.note, IsEmpty());
  EXPECT_THAT(match.problem, IsEmpty());
}

struct Alike {
  std::string name;
  Texts first, other;
  std::string ignored;
};

class AlikeNames : public testing::TestWithParam<Alike> {};

// The other file has the same names in reverse, so that the order never helps.
TEST_P(AlikeNames, AreMatchedAndNoted) {
  const auto& [name, first, other, ignored] = GetParam();
  Texts backwards = other;
  std::reverse(backwards.begin(), backwards.end());
  const auto count = static_cast<int>(first.size());
  for (const bool swapped : {false, true}) {
    const NameMatch match = swapped ? matched(backwards, first) : matched(first, backwards);
    EXPECT_EQ(match.problem, "");
    for (int i = 0; i < count; ++i) EXPECT_EQ(match.partners[static_cast<std::size_t>(i)], count - 1 - i);
    EXPECT_THAT(match.note, AllOf(HasSubstr("names matched after ignoring "), HasSubstr(ignored), HasSubstr("with '")));
  }
}

INSTANTIATE_TEST_SUITE_P(
    Kinds, AlikeNames,
    testing::Values(
        Alike{"Case", {"Nose", "TAIL", "eye"}, {"nose", "tail", "Eye"}, "case:"},
        Alike{"Blanks", {"left eye", "right  eye", "nose"}, {"left_eye", "right-eye", "nose"}, "blanks, _ and -:"},
        Alike{"OuterBlanks", {" nose", "tail "}, {"nose", "tail"}, "blanks, _ and -:"},
        Alike{"CaseAndBlanks", {"Left Eye", "Nose"}, {"left_eye", "nose"}, "case; blanks, _ and -:"},
        Alike{"Zeros", {"01", "02", "10"}, {"1", "2", "10"}, "leading zeros:"},
        Alike{"ZerosWithin", {"S007", "S010", "S100"}, {"S7", "S10", "S100"}, "leading zeros:"},
        Alike{"Extensions", {"S1.jpg", "S2.JPG", "S3.tif"}, {"S1", "S2", "S3"}, "folders and extensions:"},
        Alike{"Folders", {"img/S1.png", "img\\S2.png"}, {"S1", "S2"}, "folders and extensions:"},
        Alike{"Doubled", {"S1.mrk.json", "S2.nii.gz"}, {"S1", "S2"}, "folders and extensions:"},
        Alike{"Prefix", {"LM1", "LM2", "LM10"}, {"1", "2", "10"}, "'lm' at the beginning of all names of "},
        Alike{"PrefixOfWords", {"lm_nose", "lm_tail"}, {"nose", "tail"}, "'lm' at the beginning of all names of "},
        Alike{"Suffix", {"spec_a_1", "spec_b_1"}, {"spec_a", "spec_b"}, "'1' at the end of all names of "},
        Alike{"NumberedSuffix", {"7_1", "8_1"}, {"7", "8"}, "'-1' at the end of all names of "},
        Alike{
            "BothNumbers", {"F-1", "F-2", "F-3"}, {"F_1-1", "F_1-2", "F_1-3"}, "'f' at the beginning of all names of "},
        Alike{"Umlauts", {"ä_1", "ö_1"}, {"ä", "ö"}, "'1' at the end of all names of "}),
    [](const auto& parameter) { return parameter.param.name; });

TEST(NameMatching, KeepsWhatDistinguishesNamesOfOneFile) {
  for (const auto& [first, other] : std::vector<std::pair<Texts, Texts>>{
           {{"left_1", "left_2"}, {"right-1", "wrong-2"}},     // nothing that all share but in one
           {{"1-11", "2-11"}, {"11-1", "11-2"}},               // parts of numbers in another order
           {{"10", "11", "12"}, {"0", "1", "2"}},              // a digit that all share
           {{"1.05", "1.5"}, {"1.005", "1.50"}},               // no leading zeros
           {{"Acer.rubrum", "Acer.album"}, {"Acer", "Bcer"}},  // no extensions
           {{"nose", ""}, {"tail", ""}}}) {
    const NameMatch match = matched(first, other);
    EXPECT_THAT(match.partners, Each(-1)) << first.front();
    EXPECT_THAT(match.note, IsEmpty());
  }
}

// Males are not females, though numbers remain of both.
TEST(NameMatching, LeavesOutWhatAllShareOfOneFileAloneForSpecimens) {
  EXPECT_THAT(matched({"male_1", "male_2"}, {"female_1", "female_2"}, NameKind::kSpecimens).partners, Each(-1));
  EXPECT_THAT(matched({"a_nose", "a_tail"}, {"b_nose", "b_tail"}).partners, Each(-1));
  EXPECT_EQ(matched({"skull-1", "skull-2"}, {"F-1", "F-2"}).matched(), 2);
}

TEST(NameMatching, RefusesNamesThatBecomeAlike) {
  for (const auto& [first, other] : std::vector<std::pair<Texts, Texts>>{
           {{"Nose", "nose"}, {"NOSE", "tail"}}, {{"NOSE", "tail"}, {"Nose", "nose"}}, {{"1", "01"}, {"001", "2"}}})
    EXPECT_THAT(matched(first, other).problem, HasSubstr("are alike")) << first.front();
  EXPECT_THAT(matched({"a", "a"}, {"a", "b"}).problem,
              HasSubstr("a.csv: the names 'a', 'a' are alike, and 'a' of b.csv"));
  // They disturb nobody where the other file has no such name.
  const NameMatch match = matched({"Nose", "nose", "tail"}, {"Tail", "eye", "fin"});
  EXPECT_THAT(match.partners, ElementsAre(-1, -1, 0));
  EXPECT_THAT(match.problem, IsEmpty());
  EXPECT_THAT(match.unmatched(), ElementsAre(0, 1));
  EXPECT_THAT(match.spare(3), ElementsAre(1, 2));
}

TEST(NameMatching, RefusesCountsFromZeroAndOne) {
  for (const Texts& zero : {Texts{"0", "1", "2"}, {"2", "0", "1"}, {"LM0", "LM1", "LM2"}, {"00", "01", "02"}})
    for (const Texts& one : {Texts{"1", "2", "3"}, {"LM3", "LM2", "LM1"}, {"1", "2", "3", "4"}}) {
      EXPECT_THAT(matched(zero, one).problem,
                  AllOf(HasSubstr("a.csv numbers landmarks from 0 to 2, b.csv from 1 to"),
                        HasSubstr("either 0 of the one is 1 of the other, or equal numbers are the same")));
      EXPECT_THAT(matched(one, zero).problem, HasSubstr("b.csv numbers landmarks from 0 to 2, a.csv from 1 to"));
    }
  EXPECT_THAT(matched({"0", "5", "7"}, {"5", "7"}).problem, IsEmpty());
  // A table may have more rows than there are specimens.
  EXPECT_THAT(matched({"1", "2"}, {"0", "1", "2", "3"}, NameKind::kSpecimens).problem, IsEmpty());
  EXPECT_THAT(matched({"1", "2"}, {"0", "1"}, NameKind::kSpecimens).problem,
              HasSubstr("numbers specimens from 0 to 1"));
}

TEST(NameMatching, NumbersLandmarksWithoutNames) {
  EXPECT_THAT(numbers_for({"b", {"2", "3", "1"}}, 3), ElementsAre("1", "2", "3"));
  EXPECT_THAT(numbers_for({"b", {"LM0", "LM1", "LM2"}}, 3), ElementsAre("0", "1", "2"));
  EXPECT_THAT(numbers_for({"b", {"1", "2", "4"}}, 4), ElementsAre("1", "2", "3", "4"));
  EXPECT_THAT(numbers_for({"b", {"1", "2", "4"}}, 3), IsEmpty());
  EXPECT_THAT(numbers_for({"b", {"1", "2", "3"}}, 4), IsEmpty());
  EXPECT_THAT(numbers_for({"b", {"0", "2"}}, 3), IsEmpty());
  EXPECT_THAT(numbers_for({"b", {"nose", "tail"}}, 2), IsEmpty());
}

// Of 1,000 names 10 are changed by one random letter: each changed one is reported, and nobody gets another's partner.
TEST(NameMatching, FindsEveryChangedName) {
  std::mt19937 random(7);
  for (int round = 0; round < 20; ++round) {
    Texts names;
    for (int i = 0; i < 1000; ++i) names.push_back("wing_" + std::to_string(10000 + 37 * i));
    Texts table = names;
    std::shuffle(table.begin(), table.end(), random);
    std::vector<std::string> changed;
    for (int k = 0; k < 10; ++k) {
      std::string& name = table[static_cast<std::size_t>(100 * k) + random() % 100];
      changed.push_back(name);
      name[random() % name.size()] = "0123456789xyz"[random() % 13];
      // `wing013589` is `wing_13589` without its `_` and with a leading zero, and matches by rule.
      if (name == changed.back() || name[4] == '0') changed.pop_back();
    }
    const NameMatch match = matched(names, table, NameKind::kSpecimens);
    Texts lonely;
    for (const int i : match.unmatched()) lonely.push_back(names[static_cast<std::size_t>(i)]);
    for (const std::string& name : changed) EXPECT_THAT(lonely, testing::Contains(name));
    for (std::size_t i = 0; i < names.size(); ++i)
      if (match.partners[i] >= 0) {
        const std::string& partner = table[static_cast<std::size_t>(match.partners[i])];
        EXPECT_TRUE(partner == names[i] || partner == "wing0" + names[i].substr(5)) << partner << ' ' << names[i];
      }
  }
}

}  // namespace
}  // namespace pulson
