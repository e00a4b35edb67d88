#pragma once

#include "program.hpp"

namespace pulson {

/// A run of the paper's pair but for -o.
inline constexpr const char* kPair =
    "ensemble --q 0,10 --p 4,1 --kernel gaussian:alpha=1 --noise ch-sd:beta=1.5,on=2 --no-picture ";

/// Runs of the verb `ensemble`.
class EnsembleProgram : public Program {
 protected:
  static ProgramRun run_pair(const std::string& options) { return run(words(kPair + options)); }

  /// The record but for the lines that describe the machine.
  static std::string record_of(const std::string& folder) {
    std::istringstream stream(contents(folder + "/ensemble.json"));
    std::string text;
    for (std::string line; std::getline(stream, line);)
      if (line.find("\"seconds\"") == std::string::npos && line.find("\"threads\"") == std::string::npos)
        text += line + "\n";
    return text;
  }

  static void expect_same_results(const std::string& a, const std::string& b) {
    EXPECT_EQ(names_in(a), names_in(b));
    EXPECT_GT(record_of(a).size(), 500U);
    EXPECT_TRUE(record_of(a) == record_of(b)) << "ensemble.json of " << a << " and " << b;
    for (const std::string name : {"/means.csv", "/densities.csv"})
      EXPECT_TRUE(contents(a + name) == contents(b + name)) << name << " of " << a << " and " << b;
  }
};

}  // namespace pulson
