// Reads two shapes, flows the first onto the second, and says how close it came.
//
//   $ 01_register
//   rms 0.003609, before 0.2841

#include <iostream>

#include <pulson/pulson.hpp>

int main(int argc, char** argv) {
  const pulson::Landmarks source =
      pulson::formats::read_landmarks(argc > 2 ? argv[1] : "sample_shapes/fish_source.csv");
  const pulson::Landmarks target =
      pulson::formats::read_landmarks(argc > 2 ? argv[2] : "sample_shapes/fish_target.csv");
  const pulson::matching::Registration registration = pulson::matching::register_shapes(source, target);
  std::cout.precision(4);
  std::cout << "rms " << registration.rms() << ", before " << registration.initial_rms() << '\n';
}
