#include "reorderings.hpp"

#include <numeric>

namespace pulson::audit {

Points reordered(const Points& shape, int begin, bool reversed) {
  const auto n = static_cast<int>(shape.cols());
  std::vector<int> order;
  for (int k = 0; k < n; ++k) order.push_back(((reversed ? begin - k : begin + k) % n + n) % n);
  return shape(Eigen::all, order);
}

Points exchanged(Points shape, int a, int b) {
  shape.col(a).swap(shape.col(b));
  return shape;
}

Points run_reversed(Points shape, int first, int last) {
  for (; first < last; ++first, --last) shape.col(first).swap(shape.col(last));
  return shape;
}

std::vector<int> run_of(int first, int last) {
  std::vector<int> run(static_cast<std::size_t>(last - first + 1));
  std::iota(run.begin(), run.end(), first);
  return run;
}

}  // namespace pulson::audit
