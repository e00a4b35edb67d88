// The reports that verbs write: pages that need nothing beside themselves.

#include <gmock/gmock.h>

#include "program.hpp"

namespace pulson {
namespace {

using testing::HasSubstr;
using testing::Not;
using testing::StartsWith;

class Reports : public Program {
 protected:
  static std::size_t count_of(const std::string& text, const std::string& part) {
    std::size_t count = 0;
    for (std::size_t i = text.find(part); i != std::string::npos; i = text.find(part, i + part.size())) ++count;
    return count;
  }

  // Rows of the table that begins with this head; the head is one.
  static std::size_t rows_of_table(const std::string& page, const std::string& head) {
    const std::size_t begin = page.find("<button type=\"button\">" + head + "</button>");
    return begin == std::string::npos ? 0 : count_of(page.substr(begin, page.find("</table>", begin) - begin), "<tr>");
  }

  static std::string report() {
    std::string page = contents("out/report.html");
    EXPECT_THAT(page, StartsWith("<!DOCTYPE html>"));
    EXPECT_LT(page.size(), 2'000'000U);
    // What is embedded is base64, in which none of these occurs.
    for (const char* reference : {"http:", "https:", "//www", "<link", "@import", "url(", "src=\"/", "src=\"."})
      EXPECT_THAT(page, Not(HasSubstr(reference)));
    return page;
  }
};

TEST_F(Reports, RegisterTellsWhatItDidAndShowsIt) {
  const ProgramRun done = run({"register", sample("swap_source"), sample("swap_target"), "-o", "out", "--noise",
                               "ch-sd:beta=2", "--steps", "10"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("report.html"));
  const std::string page = report();
  EXPECT_THAT(page, HasSubstr("pulson register " + sample("swap_source") + ' ' + sample("swap_target") +
                              " -o out --noise ch-sd:beta=2 --steps 10</code>"));
  EXPECT_THAT(page, HasSubstr("<p class=\"lead\">Matched: 2 landmarks in 1D"));
  EXPECT_THAT(page, HasSubstr("1 pair of landmarks changed order."));
  EXPECT_THAT(page, HasSubstr("<canvas"));
  EXPECT_EQ(count_of(page, "<img src=\"data:image/"), 1U);
  EXPECT_EQ(rows_of_table(page, "landmark"), 2U);
  EXPECT_THAT(page, HasSubstr("displacement by the noise"));
}

TEST_F(Reports, ShowTheFormatOfPicturesThatThereIs) {
  const Arguments usual = {"register", sample("swap_source"), sample("swap_target"), "-o", "out"};
  ProgramRun done = run(joined(usual, words("--pictures svg,pdf --width 120")));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("registration.svg, registration.pdf, report.html\n"));
  EXPECT_THAT(report(), HasSubstr("<img src=\"data:image/svg+xml;base64,"));
  EXPECT_FALSE(std::filesystem::exists("out/registration.png"));
  ASSERT_EQ(run(joined(usual, words("--pictures pdf"))).exit_code, 0);
  EXPECT_THAT(report(), Not(HasSubstr("<img")));
  for (const auto& [options, message] : {std::pair("--pictures gif", "--pictures: 'gif' is not a format of pictures"),
                                         {"--pictures ,", "'' is not a format of pictures"},
                                         {"--width 0", "--width is 0"},
                                         {"--dpi -1", "--dpi is -1"},
                                         {"--width 1", "pictures 4 pixels wide"},
                                         {"--dpi 1e6", "it must be from 100 to 30000"}}) {
    done = run(joined(usual, words(options)));
    EXPECT_EQ(done.exit_code, 2) << options;
    EXPECT_THAT(done.err, HasSubstr(message)) << options;
  }
}

TEST_F(Reports, RegisterMarksALandmarkThatTheOthersDoNotPredict) {
  write("a.csv", "x,y\n0,0\n1,0\n2,0\n0,1\n1,1\n2,1\n0,2\n1,2\n2,2\n");
  // The middle one is to go where no other goes.
  write("b.csv", "x,y\n0.1,0\n1.11,0\n2.1,0.01\n0.1,1\n3.4,2.7\n2.1,1\n0.1,2.01\n1.1,2\n2.1,2\n");
  const ProgramRun done =
      run(words("register a.csv b.csv -o out --kernel gaussian:alpha=2 --sigma 0.05 --lambda 10 "
                "--no-picture"));
  const std::string page = report();
  EXPECT_EQ(count_of(page, "aria-label=\"outlier\""), 1U) << done.err;
  EXPECT_THAT(page, HasSubstr("Prediction doubts one landmark, marked below."));
  EXPECT_THAT(page, HasSubstr("\"outliers\":[4]"));
  EXPECT_THAT(page, Not(HasSubstr("<img")));
  EXPECT_THAT(page, HasSubstr("\"grid\":[["));
}

TEST_F(Reports, RegisterQuotesItsCommandAndEscapesNames) {
  std::filesystem::copy(sample("swap_source"), "<b> it's.csv");
  const ProgramRun done = run({"register", "<b> it's.csv", sample("swap_target"), "-o", "out", "--noise",
                               "ch-sd:beta=2", "--no-picture", "--json", "-"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string page = report();
  EXPECT_THAT(page, HasSubstr("pulson register '&lt;b&gt; it'\\''s.csv' "));
  EXPECT_THAT(page, Not(HasSubstr("<b>")));
}

TEST_F(Reports, RegisterReportsOutlinesWithoutCorrespondence) {
  const ProgramRun done = run({"register", sample("ellipse_source"), sample("hand_target"), "-o", "out", "--data",
                               "varifold", "--sigma", "0.1", "--steps", "5", "--max-iterations", "5", "--no-picture"});
  ASSERT_THAT(done.exit_code, testing::AnyOf(0, 3)) << done.err;
  const std::string page = report();
  EXPECT_THAT(page, HasSubstr("to the nearest point of the target"));
  EXPECT_THAT(page, HasSubstr("\"targetOutlines\":[["));
  EXPECT_EQ(done.exit_code == 3, page.find("Warning: not converged") != std::string::npos);
}

TEST_F(Reports, CompareTellsTheVerdictAndEveryModel) {
  const ProgramRun done = run({"compare", sample("swap_source"), sample("swap_target"), "-o", "out", "--sigma", "0.05",
                               "--noise", "none", "--noise", "ch-sd:beta=1", "--lambda", "1"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string page = report();
  EXPECT_THAT(page,
              HasSubstr("<p class=\"lead\">One shape, to which no path of none leads, but of ch-sd:beta=1 at cost "
                        "0.667.</p>"));
  EXPECT_THAT(page, HasSubstr(">Asked: which of none and ch-sd:beta=1 best explains 1 shape"));
  EXPECT_EQ(rows_of_table(page, "noise"), 2U);
  EXPECT_EQ(count_of(page, "<tr><td>ch-sd:beta=1</td>"),
            6U);  // of evidence, numbers, matches, two kinds of paths, shapes
  EXPECT_EQ(count_of(page, "<img src=\"data:image/"), 1U);
  EXPECT_THAT(page, HasSubstr("--noise ch-sd:beta=1 --lambda 1</code>"));
  const nlohmann::json recorded = read_json("out/comparison.json");
  char evidence[32];
  std::snprintf(evidence, sizeof evidence, ">%.2f<", recorded["models"][1]["log_evidence"].get<double>());
  EXPECT_THAT(page, HasSubstr(evidence));
}

TEST_F(Reports, CompareReportsAStudyOfRecovery) {
  const ProgramRun done = run({"compare",
                               sample("swap_source"),
                               sample("swap_target"),
                               "-o",
                               "out",
                               "--sigma",
                               "0.05",
                               "--noise",
                               "none",
                               "--noise",
                               "ch-sd:beta=1",
                               "--lambda",
                               "1",
                               "--simulate",
                               "ch-sd:beta=1",
                               "--count",
                               "2",
                               "--cohort-size",
                               "2",
                               "--steps",
                               "4",
                               "--no-picture"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string page = report();
  EXPECT_EQ(rows_of_table(page, "drawn from"), 1U);
  EXPECT_THAT(page, HasSubstr("2 cohorts of 2 shapes"));
}

TEST_F(Reports, SimulateShowsItsPathsAndHowTheyEnded) {
  ProgramRun done = run({"simulate", "--shape", sample("swap_source"), "--noise", "ch-sd:beta=0.1", "--samples", "3",
                         "--steps", "8", "-o", "out"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  EXPECT_THAT(done.out, HasSubstr("report.html"));
  std::string page = report();
  EXPECT_THAT(page, HasSubstr("3 sample paths of 2 landmarks in 1D to t = 1. All were followed to their end."));
  EXPECT_THAT(page, HasSubstr("/>2 other paths</label>"));
  EXPECT_EQ(rows_of_table(page, "path"), 3U);
  EXPECT_EQ(rows_of_table(page, "landmark"), 2U);
  EXPECT_EQ(count_of(page, "<img src=\"data:image/"), 1U);
  done = run(words("simulate --q 0,1 --p 1e5,1 --noise ch-sd:beta=1 --dt 0.5 --time 4 --no-picture -o out"));
  page = report();
  EXPECT_THAT(page, HasSubstr("<h1>Sample paths of 2 landmarks</h1>"));
  EXPECT_EQ(done.exit_code == 3, page.find("Warning: 1 of 1 paths did not reach their end") != std::string::npos);
}

TEST_F(Reports, EnsembleShowsTheMeanAndSomePaths) {
  const ProgramRun done = run({"ensemble", "--shape", sample("discs_source"), "--noise", "ch-sd:beta=0.02", "--samples",
                               "64", "--steps", "6", "-o", "out", "--no-picture"});
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string page = report();
  EXPECT_THAT(page, HasSubstr("64 sample paths of 34 landmarks in 2D to t = 1, 64 of them clean."));
  EXPECT_THAT(page, HasSubstr("/>ellipses of 90 % at the end</label>"));
  EXPECT_THAT(page, HasSubstr("/>30 sample paths</label>"));
  EXPECT_THAT(page, HasSubstr("mean&nbsp;y"));
  EXPECT_EQ(rows_of_table(page, "landmark"), 34U);
}

TEST_F(Reports, FokkerPlanckGivesTheProbabilityOfJson) {
  const ProgramRun done =
      run(words("fokker-planck --q 0,4 --p 4,1 --kernel gaussian:alpha=1 --noise ch-sd:beta=1 "
                "--time 4 --samples 64 -o out"));
  ASSERT_EQ(done.exit_code, 0) << done.err;
  const std::string page = report();
  char probability[64];
  std::snprintf(probability, sizeof probability, "with probability %.5f",
                read_json("out/fokker_planck.json")["probability"].get<double>());
  EXPECT_THAT(page, HasSubstr(probability));
  EXPECT_EQ(rows_of_table(page, "grid"), read_json("out/fokker_planck.json")["grids"].size());
  EXPECT_THAT(page, HasSubstr("standard error"));
}

TEST_F(Reports, AreLeftAloneWhereTheInputIsBad) {
  std::filesystem::create_directory("out");
  write("out/report.html", "an earlier one");
  EXPECT_EQ(run({"register", sample("swap_source"), "missing.csv", "-o", "out"}).exit_code, 2);
  EXPECT_EQ(run({"compare", sample("swap_source"), "missing.csv", "-o", "out"}).exit_code, 2);
  EXPECT_EQ(contents("out/report.html"), "an earlier one");
}

}  // namespace
}  // namespace pulson
