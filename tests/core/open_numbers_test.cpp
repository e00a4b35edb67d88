// The grammar of numbers that are fitted.

#include "core/open_numbers.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::ThrowsMessage;

const NameTable<int>& two_models() {
  static const NameTable<int> table("noise", {{"shake", {{"beta", "", "", true}, {"on", "all", ""}}, "", 0},
                                              {"turn", {{"beta", "", ""}, {"gamma", "", ""}}, "", 0}});
  return table;
}

std::vector<std::string> names_of(const OpenSpec& spec) {
  std::vector<std::string> names;
  for (const OpenNumber& number : spec.open) names.push_back(number.name);
  return names;
}

TEST(OpenNumber, IsAWordWithAStartAndAPrior) {
  struct Case {
    const char* text;
    const char* start;
    std::optional<double> log_deviation;
  };
  for (const Case& c : {Case{"fit", "", {}}, Case{"2%:fit", "2%", {}}, Case{"fit(0.5)", "", 0.5},
                        Case{"1e-3:fit(0.25)", "1e-3", 0.25}}) {
    const std::optional<OpenNumber> number = OpenNumber::parse(c.text, "beta");
    ASSERT_TRUE(number) << c.text;
    EXPECT_EQ(number->start, c.start);
    EXPECT_EQ(number->log_deviation, c.log_deviation);
  }
  for (const char* value : {"2", "2%", "auto", "1/3/5", "constant"})
    EXPECT_FALSE(OpenNumber::parse(value, "")) << value;
}

TEST(OpenNumber, RefusesOtherWords) {
  for (const char* text : {"fitted", "fit()", "fit(0.5", "fit 0.5"})
    EXPECT_THAT([&] { OpenNumber::parse(text, "--sigma"); }, ThrowsMessage<InputError>(HasSubstr("fit(0.5)"))) << text;
  EXPECT_THAT([] { OpenNumber::parse("2:fix", "--sigma"); }, ThrowsMessage<InputError>(HasSubstr("2:fit")));
  EXPECT_THAT([] { OpenNumber::parse("fit(x)", "--sigma"); },
              ThrowsMessage<InputError>(HasSubstr("a number is needed")));
  for (const char* text : {"fit(0)", "fit(-1)", "fit(nan)", "fit(inf)"})
    EXPECT_THAT([&] { OpenNumber::parse(text, "--sigma"); }, ThrowsMessage<InputError>(HasSubstr("greater than 0")));
}

TEST(OpenSpec, TakesTheFittedNumbersOut) {
  const OpenSpec one = OpenSpec::parse("shake:beta=fit,on=1/2", "noise");
  EXPECT_EQ(one.text, "shake:on=1/2");
  EXPECT_THAT(names_of(one), ElementsAre("beta"));
  EXPECT_EQ(OpenSpec::parse("shake:on=1,beta=2%:fit(0.3)", "noise").text, "shake:on=1,beta=2%");
  EXPECT_EQ(OpenSpec::parse("shake:beta=fit", "noise").text, "shake");
  EXPECT_EQ(OpenSpec::parse("shake:beta=1e+3,on=2", "noise").text, "shake:beta=1e+3,on=2");
  EXPECT_TRUE(OpenSpec::parse("shake:beta=1", "noise").open.empty());
}

TEST(OpenSpec, NamesTheTermsOfASum) {
  const OpenSpec sum = OpenSpec::parse("turn:beta=fit,gamma=1+shake:beta=3:fit+turn:beta=1,gamma=fit(0.1)", "noise");
  EXPECT_EQ(sum.text, "turn:gamma=1+shake:beta=3+turn:beta=1");
  EXPECT_THAT(names_of(sum), ElementsAre("turn.beta", "shake.beta", "turn#2.gamma"));
}

TEST(OpenSpec, KnowsWhatIsMissing) {
  EXPECT_NO_THROW(require_numbers(OpenSpec::parse("turn:beta=fit,gamma=2+shake:beta=fit", "noise"), two_models()));
  EXPECT_THAT(
      [] { require_numbers(OpenSpec::parse("shake", "noise"), two_models()); },
      ThrowsMessage<InputError>("noise 'shake' needs beta, as in shake:beta=100%; shake:beta=fit where it is to "
                                "be fitted"));
  EXPECT_THAT([] { require_numbers(OpenSpec::parse("shake:beta=fit+turn:beta=1", "noise"), two_models()); },
              ThrowsMessage<InputError>(HasSubstr("needs turn.gamma, as in turn:gamma=1; turn:gamma=fit")));
  EXPECT_THAT([] { require_numbers(OpenSpec::parse("shape:beta=1", "noise"), two_models()); },
              ThrowsMessage<InputError>(HasSubstr("did you mean 'shake'")));
}

}  // namespace
}  // namespace pulson
