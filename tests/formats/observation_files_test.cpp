#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pulson/formats/landmark_files.hpp"
#include "temporary_folder.hpp"

namespace pulson::formats {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;
using testing::AllOf;
using testing::HasSubstr;
using testing::StartsWith;

class ObservationFile : public InTemporaryFolder {
 protected:
  static Landmarks unnamed(int count, int d) {
    Landmarks shape;
    shape.points.setZero(d, count);
    shape.source = "a.csv";
    return shape;
  }
  static Landmarks labelled(std::vector<std::string> labels) {
    Landmarks shape = unnamed(static_cast<int>(labels.size()), 2);
    shape.labels = std::move(labels);
    return shape;
  }
  static VectorXd weights(const std::string& text, int count) {
    write("w.csv", text);
    return read_weights("w.csv", unnamed(count, 2));
  }
  static std::vector<MatrixXd> covariances(const std::string& text, int count, int d) {
    write("r.csv", text);
    return read_covariances("r.csv", unnamed(count, d));
  }
  static std::string weights_error(const std::string& text, int count = 2) {
    return error_of([&] { weights(text, count); });
  }
  static std::string covariances_error(const std::string& text, int d = 2) {
    return error_of([&] { covariances(text, 2, d); });
  }
};

using Weights = ObservationFile;
using Covariances = ObservationFile;

TEST_F(Weights, AreReadWithAndWithoutHeader) {
  const std::vector<std::string> texts = {"1\n0\n2.5e-3\n", "weight\n1\n0\n0.0025",
                                          "# how sure\n\n 1\r\n+0\r\n.25e-2\r\n", "\"weight\"\n\"1\"\n0\n0.0025\n"};
  for (const std::string& text : texts) EXPECT_EQ(weights(text, 3), Eigen::Vector3d(1, 0, 0.0025)) << text;
}

TEST_F(Weights, ErrorsNameFileAndLine) {
  EXPECT_EQ(weights_error("w\n1\n-2\n"), "w.csv:3: the weight is -2; it must be 0 or greater");
  for (const char* wrong : {"one", "nan", "inf", "NA", "1e999"})
    EXPECT_EQ(weights_error("1\n\n" + std::string(wrong)),
              "w.csv:3: '" + std::string(wrong) + "' is not a finite number");
  EXPECT_EQ(weights_error("1,2\n3,4\n"), "w.csv:1: 2 numbers; a row holds one weight");
  EXPECT_EQ(weights_error("1\n2\n3\n"), "w.csv has 3 rows of numbers; each of the 2 landmarks needs one");
  EXPECT_EQ(weights_error("weight\n1\n"), "w.csv has 1 row of numbers; each of the 2 landmarks needs one");
  EXPECT_THAT(weights_error(" \n"), HasSubstr("w.csv is empty"));
  EXPECT_THAT(error_of([] { read_weights("none.csv", unnamed(2, 2)); }),
              AllOf(HasSubstr("none.csv"), HasSubstr("No such file")));
}

TEST_F(Covariances, AreReadInEveryForm) {
  const MatrixXd full = (MatrixXd(3, 3) << 4, 1, 0.5, 1, 3, -1, 0.5, -1, 2).finished();
  const std::vector<MatrixXd> found = covariances("4,1,0.5,3,-1,2\n4,1,0.5,1,3,-1,0.5,-1,2\n0.25\n1,2,3\n", 4, 3);
  ASSERT_EQ(found.size(), 4U);
  EXPECT_EQ(found[0], full);
  EXPECT_EQ(found[1], full);
  EXPECT_EQ(found[2], 0.25 * MatrixXd::Identity(3, 3));
  EXPECT_EQ(found[3], Eigen::Vector3d(1, 2, 3).asDiagonal().toDenseMatrix());
  const MatrixXd plane = (MatrixXd(2, 2) << 2, 1, 1, 3).finished();
  for (const char* text : {"2,1,3", "xx;xy;yy\n2;1;3\n", "2\t1\t1\t3\n", "# R\n 2  1   3 \n"})
    EXPECT_EQ(covariances(text, 1, 2).front(), plane) << text;
  EXPECT_EQ(covariances("0.5\n", 1, 1).front(), MatrixXd::Constant(1, 1, 0.5));
}

TEST_F(Covariances, ErrorsNameFileAndLine) {
  for (const char* wrong : {"0", "-1", "1,-1", "1,2,1", "2,1,1.1,2"})
    EXPECT_EQ(covariances_error("# R\n1,1\n" + std::string(wrong)),
              "r.csv:3: the covariance is not symmetric and positive definite")
        << wrong;
  EXPECT_EQ(covariances_error("1,0,1\n1,x,1\n"), "r.csv:2: 'x' is not a finite number");
  EXPECT_EQ(covariances_error("1,,1\n1,0,1\n"), "r.csv:1: '' is not a finite number");
  EXPECT_THAT(covariances_error("1,2,3,4,5\n1\n"),
              AllOf(StartsWith("r.csv:1: 5 numbers; a covariance in 2D takes 1"),
                    HasSubstr("2 (variances of the axes)"), HasSubstr("3 (upper triangle by rows) or 4")));
  EXPECT_THAT(covariances_error("1,2,3\n1,2\n", 3), StartsWith("r.csv:2: 2 numbers; a covariance in 3D"));
  EXPECT_EQ(covariances_error("1\n"), "r.csv has 1 row of numbers; each of the 2 landmarks needs one");
}

}  // namespace
}  // namespace pulson::formats
