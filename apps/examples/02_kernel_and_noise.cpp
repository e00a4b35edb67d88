// Chooses the kernel and the noise. Two points on a line are to change places: no flow can do that, noise in the
// positions can, and the action is what it costs. Wrong input, or a wrong option, is an InputError of one line.
//
//   $ 02_kernel_and_noise
//   none: not matched, energy 16.77, action 0
//   ch-sd:beta=1: matched, energy 0.1397, action 0.6736

#include <iostream>

#include <pulson/pulson.hpp>

namespace {

void compare_noises(const pulson::Landmarks& source, const pulson::Landmarks& target) {
  pulson::matching::RegistrationOptions options;
  options.kernel = "gaussian:alpha=1";
  for (const char* noise : {"none", "ch-sd:beta=1"}) {
    options.noise = noise;
    const pulson::matching::Registration registration = pulson::matching::register_shapes(source, target, options);
    std::cout << noise << (registration.matched() ? ": matched" : ": not matched")  //
              << ", energy " << registration.cost.energy << ", action " << registration.cost.action << '\n';
  }
}

}  // namespace

int main(int argc, char** argv) try {
  std::cout.precision(4);
  compare_noises(pulson::formats::read_landmarks(argc > 2 ? argv[1] : "sample_shapes/swap_source.csv"),
                 pulson::formats::read_landmarks(argc > 2 ? argv[2] : "sample_shapes/swap_target.csv"));
} catch (const pulson::Error& error) {
  std::cerr << "error: " << error.what() << '\n';
  return 2;
}
