#pragma once

#include <string>
#include <string_view>

#include <CLI/App.hpp>

namespace pulson {

// The groups of options in the help of a verb.
inline constexpr std::string_view kInputGroup = "Input and results";
inline constexpr std::string_view kModelGroup = "Model";
inline constexpr std::string_view kSearchGroup = "Search";
inline constexpr std::string_view kSamplingGroup = "Sampling";
inline constexpr std::string_view kPictureGroup = "Pictures";
inline constexpr std::string_view kManyGroup = "Many shapes";

/// What is behind the name of a group whose options --help leaves to --help-all.
inline constexpr std::string_view kMore = ", more";

/// The options of a group that few need.
inline std::string more(std::string_view group) { return std::string(group).append(kMore); }

/// Puts the options that are added next into a group.
inline void begin_group(CLI::App& verb, std::string_view group) { verb.option_defaults()->group(std::string(group)); }

}  // namespace pulson
