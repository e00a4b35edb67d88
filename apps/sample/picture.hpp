#pragma once

#include "charts/chart.hpp"
#include "draw/ensemble_picture.hpp"
#include "record.hpp"

namespace pulson {

/// Traces, ranks of the draws by chain, and posterior against prior, for each θ and the log likelihood.
charts::Chart chains_chart(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws,
                           const PosteriorSummary& summary);

/// The path that pictures show: that of the first specimen, or of a tree the first branch to an inner node.
std::size_t shown_path(const inference::PosteriorProblem& problem);
const TimeGrid& grid_of(const inference::PosteriorProblem& problem, std::size_t path);
/// Where it leads: "node X", or the target's name.
std::string end_name(const inference::PosteriorProblem& problem, std::size_t path);

/// Draws the paths of one specimen, or of a branch from the root: in the plane and in space halfway, with an ellipse
/// for each landmark; on a line over time, with a band of nine tenths.
void write_paths_picture(const inference::PosteriorProblem& problem, const inference::PosteriorDraws& draws,
                         std::size_t path, const draw::PictureFiles& files);

/// The mean path of one specimen over the draws that are kept, d×N at each time.
std::vector<Points> mean_path(const inference::PosteriorDraws& draws, std::size_t specimen);

/// The histograms of the ranks and their empirical distribution functions less uniform, with the simultaneous band.
charts::Chart calibration_chart(const inference::Calibration& calibration, const std::string& subtitle);

}  // namespace pulson
