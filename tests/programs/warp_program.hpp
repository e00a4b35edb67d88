#pragma once

#include <string>

#include "program.hpp"

namespace pulson {

/// Registrations and their maps, by the program.
class WarpProgram : public Program {
 protected:
  static std::string discs() { return std::string(PULSON_SOURCE_DIR) + "/sample_shapes/discs.png"; }

  // The two discs of the sample swap their places by noise.
  static void register_discs() {
    const ProgramRun done =
        run(joined({"register", sample("discs_source"), sample("discs_target"), "-o", "out"},
                   words("--kernel gaussian:alpha=0.4 --noise ch-sd:beta=2 --lambda 300 --no-picture -q")));
    ASSERT_EQ(done.exit_code, 0) << done.err;
  }

  // A square that becomes a larger, crooked one, in pixels of a small image.
  static void register_squares(const std::string& noise = "none") {
    write("a.csv", "x,y\n4,4\n12,4\n12,12\n4,12\n");
    write("b.csv", "x,y\n4,3\n13,5\n13,12\n3,13\n");
    const ProgramRun done = run(
        words("register a.csv b.csv -o out --kernel gaussian:alpha=8 --sigma 0.001 --no-picture -q --noise " + noise));
    ASSERT_EQ(done.exit_code, 0) << done.err;
  }

  static ProgramRun warp(const std::string& image, const std::string& options) {
    return run(joined({"warp", "out/registration.json", image}, words(options)));
  }

  static constexpr const char* kFrame = " --pixel-size 0.0066666667 --origin -2,-1.2 --flip-y ";
};

}  // namespace pulson
