// Moves other points of the plane by the map of a registration, and back. The Jacobian says how the map stretches area
// there; where it is negative, the map folds.
//
//   $ 03_warp_points
//   (-0.5, 0) goes to (-0.482, 0.0469), Jacobian 0.869
//   (0, 0.2) goes to (0.0366, 0.381), Jacobian 2.83
//   (0.5, 0) goes to (0.395, -0.00888), Jacobian 0.914
//   and back

#include <iostream>

#include <pulson/pulson.hpp>

int main(int argc, char** argv) {
  const pulson::Landmarks source =
      pulson::formats::read_landmarks(argc > 2 ? argv[1] : "sample_shapes/fish_source.csv");
  const pulson::Landmarks target =
      pulson::formats::read_landmarks(argc > 2 ? argv[2] : "sample_shapes/fish_target.csv");
  const pulson::matching::Registration registration = pulson::matching::register_shapes(source, target);

  const pulson::warp::MaterialFlow flow(pulson::matching::registration_system(registration),
                                        pulson::matching::replay(registration));
  const pulson::Points points{{-0.5, 0.0, 0.5},  // x
                              {0.0, 0.2, 0.0}};  // y
  const pulson::warp::MovedPoints moved = flow.end_with_gradients(registration.alignment.apply(points));

  std::cout.precision(3);
  for (Eigen::Index i = 0; i < points.cols(); ++i)
    std::cout << '(' << points(0, i) << ", " << points(1, i) << ") goes to (" << moved.places(0, i) << ", "
              << moved.places(1, i) << "), Jacobian " << moved.jacobians()[i] << '\n';

  const double error = (flow.inverse(moved.places).places - registration.alignment.apply(points)).norm();
  std::cout << "and back" << (error < 1e-9 ? "" : ", but not to the same place") << '\n';
}
