#include <cmath>
#include <csignal>
#include <limits>

#include <gtest/gtest.h>
#include <sys/resource.h>

#include "chart_examples.hpp"
#include "picture_files.hpp"
#include "pulson/core/errors.hpp"

namespace pulson::charts {
namespace {

class ChartErrorsTest : public PictureTest {
 protected:
  static std::string message_of_failed_write(const Chart& chart) {
    std::string message = error_of([&] { write_chart(chart, {"chart.png", "chart.svg"}); });
    EXPECT_TRUE(files().empty());
    return message;
  }

  static std::string message_of_failed_write(const Series& series, bool log_x = false, bool log_y = false) {
    return message_of_failed_write(Chart{.rows = {{{.series = {series}, .log_x = log_x, .log_y = log_y}}}});
  }
};

TEST_F(ChartErrorsTest, RefusesValuesThatCannotBeDrawn) {
  Series series = wave("w");
  series.y[3] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(message_of_failed_write(series),
            "chart: in row 1, column 1, series 'w', y 4 is nan; it must be finite and no larger than 1e+300");
  series = wave("");
  series.x[0] = -INFINITY;
  EXPECT_TRUE(contains(message_of_failed_write(series), "series 1, x 1 is -inf"));
  series = with_error(wave("w"), 0.1);
  series.error[9] = 2e300;
  EXPECT_TRUE(contains(message_of_failed_write(series), "error 10 is 2e+300"));
  series.error[9] = -0.1;
  EXPECT_TRUE(contains(message_of_failed_write(series), "an error is negative"));
  series = with_band(wave("w"), 0.1);
  series.low[2] = series.high[2] + 1;
  EXPECT_TRUE(contains(message_of_failed_write(series), "low 3 is "));
  series.low[2] = NAN;
  EXPECT_TRUE(contains(message_of_failed_write(series), "low 3 is nan"));
  series = wave("w", SeriesStyle::kSteps);
  series.x[4] = series.x[5];
  EXPECT_TRUE(contains(message_of_failed_write(series), "the edges of its bins do not increase"));
  series = wave("w");
  series.y[1] = 0;
  EXPECT_TRUE(contains(message_of_failed_write(series, false, true), "y 2 is 0, which a logarithmic axis cannot show"));
  series.x[1] = -1;
  EXPECT_TRUE(contains(message_of_failed_write(series, true, false), "x 2 is -1, which"));
  series = wave("w");
  series.colour = -3;
  EXPECT_TRUE(contains(message_of_failed_write(series), "there is no colour -3"));
}

TEST_F(ChartErrorsTest, RefusesSizesThatDisagree) {
  Series series = wave("w");
  series.x.pop_back();
  EXPECT_TRUE(contains(message_of_failed_write(series), "series 'w', 9 x for 10 values"));
  series = wave("w");
  series.style = SeriesStyle::kSteps;
  EXPECT_TRUE(contains(message_of_failed_write(series), "10 edges of bins for 10 values"));
  series = with_error(wave("w"), 0.1);
  series.error.pop_back();
  EXPECT_TRUE(contains(message_of_failed_write(series), "9 errors for 10 values"));
  series = with_band(wave("w"), 0.1);
  series.high.clear();
  EXPECT_TRUE(contains(message_of_failed_write(series), "0 high borders of a band for 10 values"));
}

TEST_F(ChartErrorsTest, RefusesPanelsThatDisagree) {
  EXPECT_EQ(message_of_failed_write(Chart{.rows = {}}), "chart: there are no panels");
  EXPECT_EQ(message_of_failed_write(Chart{.rows = {{ChartPanel{}}, {}}}), "chart: row 2 has no panels");
  const std::vector<ChartPanel> mixed{{}, {.log_y = true}};
  EXPECT_TRUE(
      contains(message_of_failed_write(Chart{.rows = {mixed}, .rows_share_y = true}), "column 2, log_y differs"));
  Series other = wave("w");
  other.colour = 2;
  EXPECT_EQ(message_of_failed_write(Chart{.rows = {{{.series = {wave("w"), other}}}}}),
            "chart: the series named 'w' have different colours, -1 and 2");
  EXPECT_TRUE(contains(message_of_failed_write(Chart{.rows = {{{.y_range = std::pair(1, 1)}}}}), "y_range is empty"));
  EXPECT_TRUE(
      contains(message_of_failed_write(Chart{.rows = {{{.reference_lines = {{NAN}}}}}}), "a reference line is nan"));
}

TEST_F(ChartErrorsTest, SaysThatTheFolderIsMissingAndWritesNeither) {
  const Chart chart{.rows = {{{.series = {wave("w")}}}}};
  EXPECT_THROW(write_chart(chart, {"chart.png", "nowhere/chart.svg"}), InputError);
  EXPECT_TRUE(files().empty());
}

// As on a disk that fills up.
TEST_F(ChartErrorsTest, KeepsNoPictureThatIsCutOff) {
  rlimit before{};
  ::getrlimit(RLIMIT_FSIZE, &before);
  const auto old_handler = std::signal(SIGXFSZ, SIG_IGN);
  const rlimit small{4096, before.rlim_max};
  ::setrlimit(RLIMIT_FSIZE, &small);
  const std::string message = message_of_failed_write(Chart{.rows = {{{.series = {wave("w")}}}}});
  ::setrlimit(RLIMIT_FSIZE, &before);
  std::signal(SIGXFSZ, old_handler);
  EXPECT_EQ(message, "cannot write 'chart.png': File too large");
}

}  // namespace
}  // namespace pulson::charts
