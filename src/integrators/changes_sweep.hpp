#pragma once

#include <vector>

#include "pulson/dynamics/stochastic_system.hpp"

namespace pulson {

/// A part of a step that has no noise, of FlowPart with (q, p) = (q⁺, p), or of AdjointFlowPart with (q, p'). It refers
/// to the path.
struct FlowSegment {
  const Points& q;
  const Points& p;
  double dt;
  bool adjoint;
};

/// Whether the noise between the parts has no share in the change of q(T) with p0.
bool changes_need_no_noise(const NoiseTraits& traits);

/// Many tangents of one path at once, as products of matrices: the changes of q(T), dN×R, for R changes of p0 (index
/// a·d + axis). Without noise in the momenta a landmark at p = 0 keeps it: it is carried along, and acts on nothing.
/// The equations of the M others are solved for themselves; the carried ones follow, each by a d×d matrix. Cost O((dM)³
/// + (dM)²R + dN dM R) a segment, memory O(dN R).
Eigen::MatrixXd changes_along(const KernelOperator& kernel, const Points& p0, const std::vector<FlowSegment>& segments,
                              const Eigen::MatrixXd& momentum_changes);

}  // namespace pulson
