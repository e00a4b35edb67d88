// Which noise do shapes call for? Twelve are made by shaking every landmark of an oval for itself; two models are
// fitted, and the one of greater evidence is found to be the right one.
//
//   $ 05_compare
//   none: score 205, -48.7 +- 7.12 from the best
//   ch-sd:beta=0.09416: score 253, 0 +- 0 from the best
//   best: ch-sd

#include <iostream>

#include <pulson/pulson.hpp>

namespace {

// End points of sample paths from rest, as shapes.
std::vector<pulson::Landmarks> shaken(const pulson::Landmarks& shape, int count) {
  const pulson::StochasticSystem system{pulson::make_kernel("gaussian:alpha=0.5"),
                                        pulson::make_noise("ch-sd:beta=0.1", shape)};
  const pulson::PhaseState rest{.q = shape.points, .p = pulson::Points::Zero(2, shape.count())};
  const auto integrator = pulson::make_integrator("variational");
  std::vector<pulson::Landmarks> shapes;
  for (const pulson::ensemble::SamplePath& sample :
       pulson::ensemble::sample_paths(system, *integrator, rest, {.seed = 5, .samples = count})) {
    shapes.push_back(shape);
    shapes.back().points = sample.path.final().q;
  }
  return shapes;
}

}  // namespace

int main(int argc, char** argv) {
  const pulson::Landmarks oval = pulson::formats::read_landmarks(argc > 1 ? argv[1] : "sample_shapes/oval.csv");
  pulson::compare::CompareOptions options;
  options.settings.kernel = "gaussian:alpha=0.5";
  options.settings.sigma = 0.01;  // of digitising, in the unit of the shapes
  // Only what ranks the models: no check of the evidence by sampling, no predictions, no maps of space.
  options.settings.importance_samples = 0;
  options.folds = 0;
  options.maps = false;
  const pulson::compare::CohortShapes shapes{.source = oval, .targets = shaken(oval, 12)};
  const pulson::compare::Comparison comparison = pulson::compare::compare_models(shapes, {"none", "ch-sd"}, options);

  std::cout.precision(3);
  for (const pulson::compare::ComparedModel& model : comparison.models)
    std::cout << pulson::shortened_spec(model.fit.noise) << ": score " << model.score << ", " << model.difference.value
              << " +- " << model.difference.standard_error << " from the best\n";
  std::cout << "best: " << comparison.models[comparison.best].noise << '\n';
}
