// Two points on a line change places, by the installed package.

#include <iostream>

#include <pulson/pulson.hpp>

#ifdef EIGEN_USE_BLAS
#error "pulson's targets must not change how their users' own Eigen code is compiled"
#endif

int main() {
  pulson::Landmarks source;
  source.points = pulson::Points{{-0.5, 0.5}};
  pulson::Landmarks target = source;
  target.points *= -1;
  pulson::matching::RegistrationOptions options;
  options.kernel = "gaussian:alpha=1";
  options.noise = "ch-sd:beta=1";
  const pulson::matching::Registration registration = pulson::matching::register_shapes(source, target, options);
  const int crossed = pulson::matching::order_inversions(source.points, registration.result);
  std::cout << "pulson " << pulson::version() << ": rms " << registration.rms() << ", action "
            << registration.cost.action << ", " << crossed << " pair crossed\n";
  return registration.matched() && crossed == 1 ? 0 : 1;
}
