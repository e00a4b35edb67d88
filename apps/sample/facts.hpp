#pragma once

#include "record.hpp"
#include "shell/facts.hpp"

namespace pulson {

/// The node at the end of a branch of a tree.
struct NodeRow {
  const PosteriorResults* results;
  std::size_t branch;
};

const Facts<inference::PosteriorDraws>& posterior_facts();
const Facts<PosteriorSummary>& convergence_facts();
const Facts<inference::Confirmation>& confirmation_facts();
const Facts<inference::PosteriorProblem>& posterior_model_facts();
/// Of a number that is drawn: a parameter, or a coordinate of momenta or positions.
const Facts<inference::DrawSummary>& draw_facts();
const Facts<NodeRow>& node_facts();

std::vector<NodeRow> node_rows(const PosteriorResults& results);

}  // namespace pulson
