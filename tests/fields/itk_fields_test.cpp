#include <gtest/gtest.h>

#ifndef PULSON_HAS_ITK

TEST(ItkFields, NeedItk) { GTEST_SKIP() << "ITK was not found when this was configured (libinsighttoolkit5-dev)"; }

#else

#include <cmath>
#include <string>

#include <itkDisplacementFieldTransform.h>
#include <itkImageFileReader.h>
#include <itkImageFileWriter.h>
#include <itkMetaImageIOFactory.h>
#include <itkNrrdImageIOFactory.h>

#include "pulson/fields/grid_fields.hpp"
#include "temporary_folder.hpp"

namespace pulson::fields {
namespace {

constexpr double kPi = 3.141592653589793;

/// A grid that is turned by 30° in its first two axes, with the displacement ψ(x) − x at each of its points, linear in
/// x, so that ITK's linear interpolation has it exactly.
template <int kDimension>
struct Example {
  using Point = Eigen::Matrix<double, kDimension, 1>;

  Example() {
    field.sizes = {9, 7, 5};
    field.spacing = {0.5, 0.25, 2};
    field.origin = {-3, 10, 4};
    field.sizes.resize(kDimension);
    field.spacing.resize(kDimension);
    field.origin.resize(kDimension);
    field.components = kDimension;
    field.direction = Eigen::MatrixXd::Identity(kDimension, kDimension);
    field.direction.topLeftCorner(2, 2) << std::cos(kPi / 6), -std::sin(kPi / 6), std::sin(kPi / 6), std::cos(kPi / 6);
    const int depth = kDimension == 3 ? field.sizes[2] : 1;
    for (int k = 0; k < depth; ++k)
      for (int j = 0; j < field.sizes[1]; ++j)
        for (int i = 0; i < field.sizes[0]; ++i) {
          const Point displacement = displacement_at(place(Eigen::Vector3d(i, j, k)));
          for (int axis = 0; axis < kDimension; ++axis) field.values.push_back(static_cast<float>(displacement(axis)));
        }
  }

  Point place(const Eigen::Vector3d& index) const {
    const Point steps = Point::Map(field.spacing.data()).cwiseProduct(index.head<kDimension>());
    return Point::Map(field.origin.data()) + field.direction * steps;
  }

  static Point displacement_at(const Point& x) {
    Point displacement = Point::Constant(0.125);
    displacement(0) += 0.25 * x(1);
    displacement(1) -= 0.5 * x(0) + x(kDimension - 1) / 16;
    return displacement;
  }

  GridField field;
};

class ItkFields : public InTemporaryFolder {
 protected:
  static void SetUpTestSuite() {
    itk::MetaImageIOFactory::RegisterOneFactory();
    itk::NrrdImageIOFactory::RegisterOneFactory();
  }

  /// ITK's transform by the field moves x by ψ(x) − x, which is how its resampling gives out(x) = image(ψ(x)).
  template <int kDimension>
  static void expect_that_itk_applies(const std::string& file, const Example<kDimension>& example) {
    using Transform = itk::DisplacementFieldTransform<double, kDimension>;
    using Field = typename Transform::DisplacementFieldType;
    const auto reader = itk::ImageFileReader<Field>::New();
    reader->SetFileName(file);
    reader->Update();
    const auto transform = Transform::New();
    transform->SetDisplacementField(reader->GetOutput());
    for (const double share : {0.0, 0.3, 0.9}) {
      const Eigen::Vector3d index(8 * share, 6 * share * share, 4 * share);
      const typename Example<kDimension>::Point x = example.place(index);
      itk::Point<double, kDimension> point;
      for (int k = 0; k < kDimension; ++k) point[k] = x(k);
      const auto moved = transform->TransformPoint(point);
      const typename Example<kDimension>::Point expected = x + example.displacement_at(x);
      for (int k = 0; k < kDimension; ++k) EXPECT_NEAR(moved[k], expected(k), 1e-5) << file << ", axis " << k;
    }
  }
};

TEST_F(ItkFields, MoveEachPointByItsDisplacement) {
  for (const bool compressed : {false, true})
    for (const char* const name : {"field.mha", "field.nrrd"}) {
      write_grid_field(name, Example<2>().field, compressed);
      expect_that_itk_applies<2>(name, Example<2>());
      write_grid_field(name, Example<3>().field, compressed);
      expect_that_itk_applies<3>(name, Example<3>());
    }
}

/// What ITK reads from our file and writes again is the same field.
TEST_F(ItkFields, AreReadFromFilesOfItk) {
  using images::Image = itk::Image<itk::Vector<float, 3>, 3>;
  const GridField field = Example<3>().field;
  for (const bool compressed : {false, true})
    for (const char* const name : {"field.mha", "field.nrrd"}) {
      SCOPED_TRACE(name);
      write_grid_field(name, field);
      const auto reader = itk::ImageFileReader<images::Image>::New();
      reader->SetFileName(name);
      const auto writer = itk::ImageFileWriter<images::Image>::New();
      writer->SetFileName(std::string("itk_") + name);
      writer->SetInput(reader->GetOutput());
      writer->SetUseCompression(compressed);
      writer->Update();
      const GridField back = read_grid_field(std::string("itk_") + name);
      EXPECT_EQ(back.sizes, field.sizes);
      EXPECT_EQ(back.components, 3);
      EXPECT_EQ(back.values, field.values);
      EXPECT_EQ(back.origin, field.origin);
      EXPECT_TRUE(back.direction.isApprox(field.direction, 1e-5)) << back.direction;
      for (int k = 0; k < 3; ++k) EXPECT_NEAR(back.spacing[k], field.spacing[k], 1e-5);
    }
}

}  // namespace
}  // namespace pulson::fields

#endif
