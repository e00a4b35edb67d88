#pragma once

#include <optional>
#include <string>
#include <vector>

#include "arguments.hpp"
#include "pulson/records/records.hpp"
#include "shell/messages.hpp"

namespace pulson {

/// A source and one target, and what is asked for of them.
struct PairTask {
  Landmarks source;
  Landmarks target;
  SourceImage image;
  matching::RegistrationOptions options;
  std::vector<std::string> notes;  ///< of the files
};

/// What is to be done with these shapes. @param notes of their files @throws InputError
PairTask pair_task(const RegisterArguments& arguments, Landmarks source, Landmarks target,
                   std::vector<std::string> notes, Progress& progress);

/// Fits first what the arguments leave open, and sets the options to it.
std::optional<inference::FittedParameters> fit_first(const RegisterArguments& arguments, PairTask& task,
                                                     Progress& progress);

/// What the map does to the order and the triangles of the landmarks.
records::TopologyCounts topology_counts(const matching::Registration& registration);

/// The other facts.
records::RegistrationFacts judged_facts(const matching::Registration& registration,
                                        const std::optional<inference::FittedParameters>& fitted);

/// A pair that was registered, and what is known of it but for its topology_counts().
struct PairMatch {
  matching::Registration registration;
  records::RegistrationFacts facts;
};

/// Within an Interrupt, which ends the search. Adds to the notes. @throws Error
PairMatch match_pair(const RegisterArguments& arguments, PairTask& task,
                     const std::optional<inference::FittedParameters>& fitted, Progress& progress);

}  // namespace pulson
