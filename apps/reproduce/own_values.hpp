#pragma once

#include <optional>
#include <string>
#include <vector>

namespace pulson {

inline constexpr double kPaperTime = 100;

/// A kernel of §5 of the paper, or one in its place.
struct PaperKernel {
  std::string spec;
  std::string name;      ///< for csv and file names
  std::string particle;  ///< "Gaussian pulsons", "peakons"
};

const std::vector<PaperKernel>& paper_kernels();

/// Which values in place of the paper's an experiment takes.
struct OwnValuesTaken {
  enum class Betas { kNone, kOne, kSeveral };
  Betas betas = Betas::kNone;
  bool others = false;  ///< kernel, noise and time
};

/// Values that were asked for in place of the paper's.
struct OwnValues {
  std::vector<double> betas{};          ///< amplitudes of the noise; empty: the paper's
  std::optional<PaperKernel> kernel{};  ///< none: the paper's
  std::string noise{};                  ///< empty: the paper's
  std::optional<double> time{};

  /// What is asked for, or the paper's.
  std::vector<double> betas_or(const std::vector<double>& of_paper) const { return betas.empty() ? of_paper : betas; }
  std::vector<PaperKernel> kernels_or(const std::vector<PaperKernel>& of_paper) const;
  std::string noise_or(const std::string& of_paper) const { return noise.empty() ? of_paper : noise; }

  /// Whether an experiment with these amplitudes in the paper is that of the paper.
  bool is_of_paper(const std::vector<double>& betas_of_paper) const;
  /// "beta 0, 1; noise …", what differs from the paper's.
  std::string text() const;
};

/// @throws InputError where the kernel is none
PaperKernel own_kernel(const std::string& spec);

/// `noise` with this amplitude, its β or σ, which need not be given in it. @throws InputError where it has none or
/// several
std::string noise_at(const std::string& noise, double amplitude);
/// The name of that amplitude: `beta`, `sigma`, or `ch-sd.beta` of a sum. @throws InputError as noise_at()
std::string amplitude_name(const std::string& noise);

}  // namespace pulson
