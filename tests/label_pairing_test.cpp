#include "pulson/core/label_pairing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace pulson {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

/// Landmark k of the file lies at (k, −k).
Landmarks labelled(const std::string& source, std::vector<std::string> labels) {
  Landmarks shape;
  const auto count = static_cast<Eigen::Index>(labels.size());
  shape.points.resize(2, count);
  shape.points.row(0) = Eigen::RowVectorXd::LinSpaced(count, 1, static_cast<double>(count));
  shape.points.row(1) = -shape.points.row(0);
  shape.labels = std::move(labels);
  shape.source = source;
  return shape;
}

TEST(PairedByLabels, TakesTheOrderOfTheFirst) {
  const Landmarks first = labelled("a.csv", {"nose", "chin", "ear"});
  Landmarks other = labelled("b.csv", {"ear", "nose", "chin"});
  other.groups = {"side", "front", "front"};
  std::vector<std::string> notes;
  const Landmarks paired = paired_by_labels(first, other, notes);
  EXPECT_EQ(paired.points, (Points(2, 3) << 2, 3, 1, -2, -3, -1).finished());
  EXPECT_EQ(paired.labels, first.labels);
  EXPECT_THAT(paired.groups, ElementsAre("front", "front", "side"));
  EXPECT_THAT(notes, ElementsAre("b.csv: its landmarks stand in another order than those of a.csv; they are paired by "
                                 "their labels"));
}

TEST(PairedByLabels, KeepsTheOrderWhereLabelsDoNotTell) {
  const Landmarks first = labelled("a.csv", {"nose", "chin", "ear"});
  for (const std::vector<std::string>& labels : {std::vector<std::string>{"nose", "chin", "ear"},
                                                 {"nose", "chin", "left ear"},
                                                 {"F-1", "F-2", "F-3"},
                                                 {"ear", "ear", "nose"},
                                                 {"ear", "", "nose"},
                                                 {}}) {
    Landmarks other = labelled("b.csv", labels);
    if (labels.empty()) other.points = Points::Random(2, 3);
    std::vector<std::string> notes;
    EXPECT_EQ(paired_by_labels(first, other, notes).points, other.points);
    EXPECT_THAT(notes, IsEmpty());
  }
}

TEST(PairedByLabels, WarnsWhereLabelsContradictTheOrder) {
  const Landmarks first = labelled("a.csv", {"nose", "chin", "ear"});
  const Landmarks other = labelled("b.csv", {"chin", "nose", "left ear"});
  std::vector<std::string> notes;
  EXPECT_EQ(paired_by_labels(first, other, notes).points, other.points);
  EXPECT_THAT(notes, ElementsAre("a.csv and b.csv: the landmark 'nose' stands at different places and other labels "
                                 "differ; landmarks are paired by their order"));
}

}  // namespace
}  // namespace pulson
