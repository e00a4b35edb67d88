#include <atomic>
#include <chrono>
#include <cmath>
#include <functional>
#include <limits>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <oneapi/tbb/global_control.h>

#include "error_of.hpp"
#include "pulson/core/landmarks.hpp"
#include "pulson/core/name_table.hpp"
#include "pulson/core/parallel.hpp"
#include "pulson/core/time_grid.hpp"

namespace pulson {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::EndsWith;
using testing::IsEmpty;
using testing::Pair;
using testing::StartsWith;

// ---- specifications

TEST(ParseSpecSum, SplitsTermsAndParameters) {
  const std::vector<Spec> specs = parse_spec_sum("gaussian:alpha=0.4+matern32:alpha=1,weight=0.5+none", "kernel");
  ASSERT_EQ(specs.size(), 3U);
  EXPECT_EQ(specs[0].name, "gaussian");
  EXPECT_THAT(specs[0].values, ElementsAre(Pair("alpha", "0.4")));
  EXPECT_EQ(specs[1].name, "matern32");
  EXPECT_THAT(specs[1].values, ElementsAre(Pair("alpha", "1"), Pair("weight", "0.5")));
  EXPECT_EQ(specs[2].name, "none");
  EXPECT_THAT(specs[2].values, IsEmpty());
}

TEST(ParseSpecSum, LeavesTheSignOfAnExponent) {
  const std::vector<Spec> specs = parse_spec_sum("gaussian:alpha=1e+3+peakon:alpha=+2", "kernel");
  ASSERT_EQ(specs.size(), 2U);
  EXPECT_EQ(specs[0].values.at("alpha"), "1e+3");
  EXPECT_EQ(specs[1].values.at("alpha"), "+2");
}

TEST(ParseSpecSum, RefusesControlCharactersInOneLine) {
  EXPECT_EQ(error_of([] { parse_spec_sum("gaussian:alpha=1\n", "kernel"); }),
            "kernel 'gaussian:alpha=1?' holds a control character");
  EXPECT_EQ(error_of([] { parse_number("1\r\n2", "x"); }), "x is '1??2'; a number is needed");
}

TEST(ParseSpecSum, RefusesMalformedTerms) {
  const auto message = [](const std::string& text) { return error_of([&] { parse_spec_sum(text, "kernel"); }); };
  EXPECT_EQ(message(""), "kernel '' has no name");
  EXPECT_EQ(message(":alpha=1"), "kernel ':alpha=1' has no name");
  for (const std::string pair : {"alpha", "alpha=", "=1", ""})
    EXPECT_EQ(message("peakon:" + pair), "kernel 'peakon': '" + pair + "' is not key=value");
  EXPECT_EQ(message("peakon:alpha=1,alpha=2"), "kernel 'peakon': alpha is given twice");
}

TEST(ParseNumber, TakesTheWholeText) {
  EXPECT_EQ(parse_number("+1.5e2", "x"), 150);
  EXPECT_EQ(parse_number("-.25", "x"), -0.25);
  for (const std::string text : {"", "+", "1x", " 1", "1 ", "1,5", "one", "1e999"})
    EXPECT_EQ(error_of([&] { parse_number(text, "x"); }), "x is '" + text + "'; a number is needed");
}

TEST(ParseNumberList, SplitsAtSlashes) {
  EXPECT_THAT(parse_number_list("1/-2.5/3", "center"), ElementsAre(1, -2.5, 3));
  EXPECT_EQ(error_of([] { parse_number_list("1//3", "center"); }), "center is ''; a number is needed");
}

TEST(NearestName, FindsOnlyWhatIsNear) {
  const std::vector<std::string> names = {"gaussian", "peakon", "matern32", "matern52"};
  EXPECT_EQ(nearest_name("gausian", names), "gaussian");
  EXPECT_EQ(nearest_name("Peakon", names), "peakon");
  EXPECT_EQ(nearest_name("matern5", names), "matern52");
  EXPECT_EQ(nearest_name("spline", names), "");
  EXPECT_EQ(nearest_name("x", {}), "");
}

// ---- tables

using Table = NameTable<std::function<double(const Parameters&)>>;

Table make_table() {
  return {"kernel",
          {{"gaussian",
            {{"alpha", "", "width"}, {"weight", "1", "factor"}},
            "smooth",
            [](const Parameters& p) { return p.positive("alpha") * p.number("weight"); }},
           {"one", {}, "constant", [](const Parameters&) { return 1.0; }}}};
}

TEST(NameTable, MakesEachTermOfASum) {
  const Table table = make_table();
  double sum = 0;
  for (const auto& [row, parameters] : table.parse("gaussian:alpha=3,weight=-2+one+gaussian:alpha=10"))
    sum += row->make(parameters);
  EXPECT_EQ(sum, -6 + 1 + 10);
  EXPECT_EQ(table.find("one").help, "constant");
}

TEST(NameTable, SaysWhatIsWrong) {
  const Table table = make_table();
  const auto message = [&](const std::string& text) { return error_of([&] { table.parse(text); }); };
  EXPECT_EQ(message("gausian:alpha=1"), "unknown kernel 'gausian'; did you mean 'gaussian'; valid: gaussian, one");
  EXPECT_THAT(message("spline"), AllOf(StartsWith("unknown kernel 'spline'"), EndsWith("valid: gaussian, one")));
  EXPECT_EQ(message("gaussian"), "kernel 'gaussian' needs alpha (width), as in gaussian:alpha=1");
  EXPECT_EQ(message("gaussian:beta=1"), "kernel 'gaussian' has no parameter 'beta'; it has: alpha, weight");
  EXPECT_EQ(message("one:beta=1"), "kernel 'one' has no parameter 'beta'; it has: none");
}

class ParametersOf : public testing::Test {
 protected:
  static Parameters given(const std::string& text) {
    static const std::vector<ParameterInfo> info = {{"v", "1", "value"}};
    return {Spec{"t", {{"v", text}}}, info, "noise 't'"};
  }
};

TEST_F(ParametersOf, ReadsNumbers) {
  EXPECT_EQ(given("-2").number("v"), -2);
  EXPECT_EQ(given("2").positive("v"), 2);
  EXPECT_EQ(given("0").non_negative("v"), 0);
  EXPECT_TRUE(given("auto").is_auto("v"));
  EXPECT_FALSE(given("1").is_auto("v"));
}

TEST_F(ParametersOf, ReadsIndicesFromOne) {
  EXPECT_THAT(given("5/1/3").indices("v"), ElementsAre(0, 2, 4));
  EXPECT_THAT(given("all").indices("v"), IsEmpty());
}

TEST_F(ParametersOf, SaysWhatIsWrong) {
  EXPECT_EQ(error_of([] { given("wide").number("v"); }), "noise 't': v is 'wide'; a number is needed");
  EXPECT_EQ(error_of([] { given("inf").number("v"); }), "noise 't': v is 'inf'; it must be finite");
  EXPECT_EQ(error_of([] { given("nan").number("v"); }), "noise 't': v is 'nan'; it must be finite");
  EXPECT_EQ(error_of([] { given("0").positive("v"); }), "noise 't': v is 0; it must be greater than 0");
  EXPECT_EQ(error_of([] { given("-1").non_negative("v"); }), "noise 't': v is -1; it must not be negative");
  for (const std::string text : {"0", "1/2.5", "-3", "1e10"})
    EXPECT_EQ(error_of([&] { given(text).indices("v"); }),
              "noise 't': v is '" + text + "'; landmarks are counted from 1, as in 1/3/5");
  EXPECT_EQ(error_of([] { given("2/1/2").indices("v"); }), "noise 't': v is '2/1/2'; it names a landmark twice");
}

// ---- landmarks

Points make_points(std::vector<double> numbers) {
  return Points::Map(numbers.data(), 2, static_cast<Eigen::Index>(numbers.size() / 2));
}

TEST(Landmarks, AreDescribedByLabelOrNumber) {
  Landmarks shape;
  shape.points = make_points({0, 0, 1, 1});
  EXPECT_EQ(shape.describe(1), "2");
  shape.labels = {"a\nb", ""};  // messages are of one line
  EXPECT_EQ(shape.describe(0), "'a?b'");
  shape.labels = {"tip", ""};
  EXPECT_EQ(shape.describe(0), "'tip'");
  EXPECT_EQ(shape.describe(1), "2");
}

TEST(LandmarksByGroup, KeepsTheOrderOfFirstAppearance) {
  Landmarks shape;
  shape.points = Points::Zero(2, 5);
  EXPECT_THAT(landmarks_by_group(shape), ElementsAre(ElementsAre(0, 1, 2, 3, 4)));
  shape.groups = {"right", "left", "right", "left", "centre"};
  EXPECT_THAT(landmarks_by_group(shape), ElementsAre(ElementsAre(0, 2), ElementsAre(1, 3), ElementsAre(4)));
}

// Both look at few pairs alone; here at all, for scattered points and an outline with equal radii.
TEST(Landmarks, DistancesAreThoseOfAllPairs) {
  Points scattered(3, 200), ring(2, 200);
  for (Eigen::Index a = 0; a < 200; ++a) {
    const auto x = static_cast<double>(a);
    scattered.col(a) << std::sin(7 * x), std::cos(5 * x * x), std::sin(3 * x + 1);
    ring.col(a) << std::cos(0.0314 * x), std::sin(0.0314 * x);
  }
  for (const Points& points : {scattered, ring}) {
    double furthest = 0;
    std::vector<double> nearest(200, 1e300);
    for (std::size_t a = 0; a < 200; ++a)
      for (std::size_t b = 0; b < 200; ++b) {
        const double apart = (points.col(a) - points.col(b)).norm();
        furthest = std::max(furthest, apart);
        if (a != b) nearest[a] = std::min(nearest[a], apart);
      }
    std::sort(nearest.begin(), nearest.end());
    EXPECT_NEAR(diameter(points), furthest, 1e-14 * furthest);
    EXPECT_NEAR(median_nearest_distance(points), nearest[99], 1e-14);
  }
}

TEST(Diameter, IsTheLargestDistance) {
  EXPECT_EQ(diameter(make_points({0, 0, 1, 0, 3, 4, 0, 1})), 5);
  EXPECT_EQ(diameter(Points::Ones(3, 1)), 0);
  EXPECT_EQ(diameter(Points(2, 0)), 0);
}

TEST(MedianDistance, IsTheLowerMiddleOne) {
  EXPECT_EQ(median_distance((Points(1, 3) << 0, 1, 5).finished()), 4);      // 1 4 5
  EXPECT_EQ(median_distance((Points(1, 4) << 0, 1, 5, 20).finished()), 5);  // 1 4 5 15 19 20
  EXPECT_EQ(median_distance((Points(1, 2) << -1, 1).finished()), 2);
  EXPECT_EQ(median_distance(Points::Ones(3, 1)), 0);
}

TEST(FindCoincident, ComparesWithTheDiameter) {
  EXPECT_EQ(find_coincident(make_points({0, 0, 1, 0, 0, 1})), std::nullopt);
  EXPECT_EQ(find_coincident(make_points({0, 0, 1, 0, 5, 5, 1, 0})), std::pair(1, 3));
  EXPECT_EQ(find_coincident(make_points({0, 0, 1000, 0, 1000, 1}), 1e-2), std::pair(1, 2));
  EXPECT_EQ(find_coincident(make_points({3, 3, 3, 3})), std::pair(0, 1));
  EXPECT_EQ(find_coincident(Points::Ones(2, 1)), std::nullopt);
}

TEST(FindCoincident, TellsTheFirstPairWhateverTheOrderInSpace) {
  EXPECT_EQ(find_coincident(make_points({9, 0, 0, 0, 5, 1, 5, 1, 9, 0, 0, 0})), std::pair(2, 3));
  EXPECT_EQ(find_coincident(make_points({0, 7, 0, 2, 0, 5, 0, 2, 0, 7})), std::pair(1, 3));
  const double missing = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(find_coincident(make_points({missing, 2, 4, 4, missing, 2, 1, 1, 4, 4})), std::pair(1, 4));
}

TEST(BoundingBox, HoldsAllPoints) {
  const auto [lower, upper] = bounding_box(make_points({0, 3, -1, 2, 5, 2.5}));
  EXPECT_EQ(lower, Eigen::Vector2d(-1, 2));
  EXPECT_EQ(upper, Eigen::Vector2d(5, 3));
}

// ---- landmarks that have a missing coordinate

const double kNone = std::numeric_limits<double>::quiet_NaN();

TEST(IncompletePoints, MissACoordinate) {
  EXPECT_THAT(incomplete_points(make_points({0, 0, kNone, 1, 2, 2, kNone, kNone, 1, kNone})), ElementsAre(1, 3, 4));
  EXPECT_THAT(incomplete_points(make_points({0, 0, 1, 1})), IsEmpty());
  EXPECT_THAT(incomplete_points(Points(2, 0)), IsEmpty());
}

TEST(IncompletePoints, AreLeftOutOfMeasures) {
  const Points complete = make_points({0, 0, 1, 0, 3, 4, 0, 1});
  const Points gapped = make_points({kNone, 90, 0, 0, 1, 0, kNone, kNone, 3, 4, 0, 1, -70, kNone});
  EXPECT_EQ(diameter(gapped), diameter(complete));
  EXPECT_EQ(median_distance(gapped), median_distance(complete));
  EXPECT_EQ(median_nearest_distance(gapped), median_nearest_distance(complete));
  EXPECT_EQ(bounding_box(gapped), bounding_box(complete));
  EXPECT_EQ(find_coincident(gapped), std::nullopt);
  EXPECT_EQ(find_coincident(make_points({kNone, 1, 2, 2, kNone, 1, 5, 5, 2, 2})), std::pair(1, 4));
}

TEST(IncompletePoints, MayBeAll) {
  const Points none = make_points({kNone, 1, 2, kNone});
  EXPECT_EQ(diameter(none), 0);
  EXPECT_EQ(median_distance(none), 0);
  EXPECT_EQ(median_nearest_distance(none), 0);
  EXPECT_EQ(find_coincident(none), std::nullopt);
  EXPECT_TRUE(bounding_box(none).first.array().isNaN().all());
  EXPECT_EQ(bounding_box(Points(3, 0)).second.size(), 3);
}

TEST(TimeGrid, EndsExactlyAtItsTime) {
  const TimeGrid grid{0.7, 3};
  EXPECT_EQ(grid.at(0), 0);
  EXPECT_EQ(grid.at(3), 0.7);
  EXPECT_DOUBLE_EQ(grid.at(1), grid.dt());
}

// ---- threads

class ParallelFor : public testing::TestWithParam<int> {
 protected:
  void SetUp() override { set_thread_count(GetParam()); }
  void TearDown() override { set_thread_count(0); }
};

TEST_P(ParallelFor, RunsEachIndexOnce) {
  for (const int count : {0, 1, 2, 1000}) {
    std::vector<std::atomic<int>> runs(static_cast<std::size_t>(count));
    parallel_for(count, [&](int i) { ++runs[static_cast<std::size_t>(i)]; });
    for (const auto& n : runs) EXPECT_EQ(n, 1);
  }
}

TEST_P(ParallelFor, MayBeNested) {
  std::vector<std::atomic<int>> runs(60);
  parallel_for(6, [&](int i) {
    parallel_for(10, [&](int j) {
      const int place = 10 * i + j;
      ++runs[static_cast<std::size_t>(place)];
    });
  });
  for (const auto& n : runs) EXPECT_EQ(n, 1);
}

TEST_P(ParallelFor, UsesIdleThreadsFromInsideATask) {
  if (GetParam() < 2 || thread_count() < 2) GTEST_SKIP() << "there is one thread";
  const auto deadline = std::chrono::steady_clock::now() + std::chrono::seconds(60);
  std::atomic<int> begun{0};
  parallel_for(2, [&](int outer) {
    if (outer == 0) return;
    parallel_for(2, [&](int) {
      ++begun;
      while (begun < 2 && std::chrono::steady_clock::now() < deadline) std::this_thread::yield();
      EXPECT_EQ(begun, 2);
    });
  });
}

TEST_P(ParallelFor, RethrowsFromInsideATask) {
  const auto run = [] {
    parallel_for(4, [](int outer) {
      parallel_for(10, [outer](int i) {
        if (outer == 2 && i == 7) throw std::runtime_error("task 7 of 2");
      });
    });
  };
  EXPECT_THROW(run(), std::runtime_error);
}

TEST_P(ParallelFor, RethrowsAndCanBeUsedAgain) {
  const auto run = [] {
    parallel_for(100, [](int i) {
      if (i == 37) throw std::runtime_error("task 37");
    });
  };
  EXPECT_THROW(run(), std::runtime_error);
  std::atomic<int> sum{0};
  parallel_for(10, [&](int i) { sum += i; });
  EXPECT_EQ(sum, 45);
}

TEST_P(ParallelFor, GivesTheSameBitsForAnyNumberOfThreads) {
  const auto blocks = [] {
    std::vector<double> sums(64);
    parallel_for(64, [&](int b) {
      for (int i = 0; i < 1000; ++i) sums[static_cast<std::size_t>(b)] += std::sin(1000.0 * b + i);
    });
    return sums;
  };
  const std::vector<double> sums = blocks();
  set_thread_count(1);
  EXPECT_EQ(sums, blocks());
}

INSTANTIATE_TEST_SUITE_P(Threads, ParallelFor, testing::Values(1, 2, 3));

// A thread that waits for the tasks of its task takes up no other task beside it. (Of two threads neither would.)
TEST(NestedTasks, AreNotMixed) {
  using oneapi::tbb::global_control;
  const global_control more(global_control::max_allowed_parallelism, 6);
  set_thread_count(6);
  static thread_local bool is_busy = false;
  std::atomic<int> mixed{0};
  const auto work = [](int amount) {
    volatile double sum = 0;
    for (int j = 0; j < 1000 * amount; ++j) sum = sum + j;
  };
  for (int turn = 0; turn < 400; ++turn)
    parallel_for(20, [&](int outer) {
      if (is_busy) ++mixed;
      is_busy = true;
      parallel_for(5, [&](int i) { work((outer + turn) * i % 11); });
      is_busy = false;
    });
  set_thread_count(0);
  EXPECT_EQ(mixed, 0);
}

TEST(ThreadCount, IsTheRequestedOneButNoMoreThanCores) {
  const int cores = thread_count();
  EXPECT_GE(cores, 1);
  set_thread_count(1);
  EXPECT_EQ(thread_count(), 1);
  set_thread_count(cores + 5);
  EXPECT_EQ(thread_count(), cores);
  set_thread_count(-1);
  EXPECT_EQ(thread_count(), cores);
  set_thread_count(0);
  EXPECT_EQ(thread_count(), cores);
}

TEST(NameTable, ShortensSpecificationsForPeople) {
  EXPECT_EQ(shortened_spec("ch-sd:beta=1.5,on=1/3/12"), "ch-sd:beta=1.5,on=1/3/12");
  EXPECT_EQ(shortened_spec("p-sd:beta=0.1,fields=grid,count=4,width=0.28136412763"),
            "p-sd:beta=0.1,fields=grid,count=4,width=0.2814");
  EXPECT_EQ(shortened_spec("p-sd:beta=1,center=0.123456789/-1234567.5,width=1e-20"),
            "p-sd:beta=1,center=0.1235/-1.235e+06,width=1e-20");
  EXPECT_EQ(shortened_spec("matern32:alpha=0.33333333+gaussian:alpha=1"), "matern32:alpha=0.3333+gaussian:alpha=1");
  EXPECT_EQ(shortened_spec(""), "");
}

}  // namespace
}  // namespace pulson
