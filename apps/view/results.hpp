#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "pulson/formats/landmark_files.hpp"

namespace pulson {

/// The shapes that a folder of results is of, so that landmarks can be placed on them again.
struct ViewedResults {
  std::vector<Landmarks> shapes;   ///< none where the page cannot show them
  std::string why;                 ///< there are none; may be empty
  std::filesystem::path folder;    ///< of the results
  std::filesystem::path report{};  ///< report.html; empty where there is none
};

/// The shapes that the record of `register`, `compare`, `sample` or `atlas` names, where their files are still there,
/// from this folder or from that of the results, are of the plane, and one at least has its picture.
ViewedResults results_of(const std::string& folder, const formats::ReadOptions& reading);

}  // namespace pulson
