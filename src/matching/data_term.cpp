#include "pulson/matching/data_term.hpp"

#include <stdexcept>

namespace pulson::matching {

Eigen::VectorXd DataTerm::residual(const Points& /*q*/) const {
  throw std::logic_error("this data term is not a sum of squares");
}

double DataTerm::log_determinant() const { throw std::logic_error("this data term is not a sum of squares"); }

}  // namespace pulson::matching
