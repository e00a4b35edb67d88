#pragma once

#include <array>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pulson/ensemble/ensemble.hpp"
#include "pulson/inference/fit_parameters.hpp"
#include "pulson/matching/landmark_verdicts.hpp"
#include "pulson/matching/registration.hpp"

namespace pulson::records {

/// Counts that measure how far the result is from a diffeomorphic image of the source; none where undefined.
struct TopologyCounts {
  std::optional<int> order_inversions;       ///< d = 1: pairs of landmarks that changed order
  std::optional<int> flipped_triangles;      ///< d = 2: flipped triangles of the source's Delaunay triangulation
  std::optional<int> target_inversions{};    ///< d = 1: pairs whose order is another one in the target
  std::optional<int> exchanged_as_target{};  ///< d = 1: of these, those that the path exchanges
  std::optional<std::vector<std::array<int, 3>>> target_flips{};  ///< d = 2: of these triangles, those of the target
};

/// Additional facts about a registration.
struct RegistrationFacts {
  TopologyCounts counts{};
  matching::LandmarkShares shares{};
  matching::LandmarkVerdicts verdicts{};
  std::string finding{};  ///< of the audit of the pair, as that the order is reversed: then no landmark is cleared
  std::optional<inference::FittedParameters> fitted{};  ///< where parameters were fitted before
  std::vector<matching::HomotopyStep> homotopy{};       ///< where it was followed
};

/// `registration.json`: the record of a registration, arrays as [landmark][axis] and increments as [step][channel] with
/// a description of each channel, numbers in the fewest digits that read back to the same bits. `source` is q0, where
/// the flow begins: the original after alignment.
std::string registration_json(const matching::Registration& registration, const RegistrationFacts& facts);

/// Reads what registration_json wrote. @param own the noise models, where the record's is one of your own
/// @throws InputError that names the file, the key and what would be right
matching::Registration read_registration(const std::filesystem::path& path, const NoiseTable* own = nullptr);

/// The same of the text of such a file; `name` is what messages call it.
matching::Registration registration_of(std::string_view text, const std::string& name, const NoiseTable* own = nullptr);

/// `residuals.csv`: one row per landmark with result and distance; for landmark data also with target and residual; and
/// with what there is of its shares, its prediction and its weight. A number that is not there, as of a target that was
/// not observed, is NA.
std::string residuals_csv(const matching::Registration& registration, const RegistrationFacts& facts);

/// `trajectory.csv`: one row per step and landmark with time, position and momentum.
std::string trajectory_csv(const matching::Registration& registration, const Trajectory& path);

/// An ensemble and all that it was made from.
struct EnsembleRun {
  StochasticSystem system;
  std::string integrator;
  Landmarks shape;  ///< at q
  PhaseState start;
  ensemble::EnsembleOptions options;
  std::vector<int> densities;  ///< steps of those histograms that are to be written
  ensemble::EnsembleSums sums;
  std::string method;  ///< how paths were computed
  int threads = 1;
  double seconds = 0;
  std::vector<std::string> notes{};  ///< on the start, for people

  bool partial() const { return sums.samples < options.shard_samples(); }
  /// Whether landmarks have an order, which clean paths keep or change.
  bool has_crossing() const { return start.q.rows() == 1 && start.q.cols() > 1 && sums.paths.clean > 0; }
};

/// The text of ensemble.json; NaN and what is not defined, as crossing in the plane, are null.
std::string ensemble_json(const EnsembleRun& run);

/// `time,landmark,quantity,axis,mean,standard_error,standard_deviation,q05,q25,q50,q75,q95`: a row for each recorded
/// time and coordinate; quantiles are empty where there is no histogram.
std::string ensemble_means_csv(const EnsembleRun& run);

/// `time,landmark,quantity,axis,low,high,density`: the bins that are not empty, of the
/// histograms that are to be written.
std::string ensemble_densities_csv(const EnsembleRun& run);

/// The CRC-32 of all on which the bits of the sums depend, as eight hexadecimal digits: that of two runs is the same
/// where one could resume from the other's checkpoint.
std::string ensemble_fingerprint(const EnsembleRun& run);

/// The sums of an unfinished ensemble or of a shard, exact, as a binary text (CBOR) that belongs to this run only: a
/// run with a different seed, noise or initial state cannot resume from it. It ends with its checksum.
std::string ensemble_checkpoint(const EnsembleRun& run);

/// A shard's checkpoint, which is all of it once it is not partial: what it says of the run, and the sums. Its noise is
/// one of noise_table(). @throws InputError if it is damaged; `name` is the file's
EnsembleRun read_ensemble_part(std::string_view bytes, std::string_view name);

/// The whole ensemble of these shards, in any order: of the same bits as in one run. `names` are their files'.
/// @throws InputError that names the shard which is missing, there twice, not finished or of another ensemble
EnsembleRun merge_ensembles(std::vector<EnsembleRun> parts, const std::vector<std::string>& names);

/// What ensemble_checkpoint wrote. @throws InputError if it is damaged or of another run; `name` is the file's
ensemble::EnsembleSums read_ensemble_checkpoint(const EnsembleRun& run, std::string_view bytes, std::string_view name);

/// What a simulation was made of, and its sample paths.
struct Simulation {
  StochasticSystem system;
  std::string integrator;
  Landmarks shape;  ///< of the start
  PhaseState start;
  ensemble::SamplePathsOptions options;
  std::vector<ensemble::SamplePath> samples;
  double seconds = 0;
};

/// The record of a simulation as JSON: what it takes to repeat it, and for each path its status, the adapted state
/// (q, p̂) at its end as [landmark][axis], and diagnostics of its steps.
std::string simulation_json(const Simulation& simulation);

/// csv of all paths: `sample,step,time,landmark,q_x,…,p_x,…`, every `every`-th step and the last; samples and landmarks
/// count from 1, sample m being path m − 1 of brownian_increments; p is the adapted momentum.
std::string sample_paths_csv(const Simulation& simulation, int every = 1);

}  // namespace pulson::records
