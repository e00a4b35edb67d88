#pragma once

// What a fuzzer does with one input. Readers may refuse it by an InputError of one line; what they take must keep the
// laws of what it is. Anything else is a finding: other exceptions, laws that are broken, sanitizers, memory, time.

#include <array>
#include <string_view>

namespace pulson::fuzz {

/// @return whether the input is worth keeping in a corpus: it reached the code that is tested
using Target = bool (*)(std::string_view input);

bool landmark_files(std::string_view input);  ///< a file whose format is recognised by its content
bool point_lists(std::string_view input);     ///< `ROW\n` and a text for the reader of that row of formats
bool tables(std::string_view input);          ///< the same, or `weights`, or `covariances`
bool arrays(std::string_view input);          ///< `vtk`, `npy`, `npz` or `roi`
bool json_landmarks(std::string_view input);  ///< the same of the rows in JSON
bool shapes(std::string_view input);          ///< for all writers, made from bytes
bool grid_fields(std::string_view input);     ///< MetaImage and NRRD
bool surfaces(std::string_view input);        ///< `ply`, `stl` or `obj`, and a file of that kind
bool carried_files(std::string_view input);   ///< `ply`, `stl`, `obj`, `vtk`, `vtp`, `csv` or `fcsv`, and such a file
bool specs(std::string_view input);           ///< of kernels, noises, integrators
bool registration_records(std::string_view input);  ///< registration.json, replayed where that is short
bool ensemble_checkpoints(std::string_view input);  ///< of one small ensemble, which goes on from it

struct NamedTarget {
  std::string_view name;  ///< of its folder in corpus/
  Target run;
};

inline constexpr std::array<NamedTarget, 12> kTargets = {{{"landmark_files", landmark_files},
                                                          {"point_lists", point_lists},
                                                          {"tables", tables},
                                                          {"arrays", arrays},
                                                          {"json_landmarks", json_landmarks},
                                                          {"shapes", shapes},
                                                          {"grid_fields", grid_fields},
                                                          {"surfaces", surfaces},
                                                          {"carried_files", carried_files},
                                                          {"specs", specs},
                                                          {"registration_records", registration_records},
                                                          {"ensemble_checkpoints", ensemble_checkpoints}}};

}  // namespace pulson::fuzz
