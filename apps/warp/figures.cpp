#include "figures.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "../messages.hpp"
#include "pulson/io/atomic_file.hpp"

namespace pulson {
namespace {

std::string percent(double part) { return fmt::format("{:.3g} %", 100 * part); }

void print_summary(const WarpFigures& figures, const WarpArguments& arguments, const WarpFrames* frames) {
  fmt::print("{} → {}\n", arguments.input, arguments.out);
  fmt::print("method     {}: {}\n", figures.method, figures.reason);
  fmt::print("map        folds {} of the {}, smallest Jacobian {:.3g}\n", percent(figures.folded_fraction),
             frames != nullptr ? "image" : "points", figures.min_jacobian);
  if (frames != nullptr) {
    fmt::print("result     {} x {} pixels, at most {} per pixel, {} uncovered, {} in holes\n", frames->width,
               frames->height, counted(figures.max_multiplicity, "sheet"), percent(figures.uncovered_fraction),
               percent(figures.hole_fraction));
    fmt::print("frame      {:.4g} landmark {} per pixel, y {}\n", frames->input.spacing[0],
               frames->input.spacing[0] == 1 ? "unit" : "units", frames->input.y_up ? "up (flipped)" : "down");
  }
  fmt::print("accuracy   landmarks to {:.1e} {}{}\n", figures.landmark_error_max,
             frames != nullptr ? "pixels" : "units",
             frames != nullptr ? fmt::format(", map to {:.1e} pixels", figures.map_error) : "");
  if (figures.ridge > 0)
    fmt::print("ridge      {:.1e}: landmarks are so close that the map reproduces their noise only approximately\n",
               figures.ridge);
  for (const ColourKey& key : figures.colours) fmt::print("colours    {}: {}\n", key.file, key.meaning);
  fmt::print("seconds    {:.3g}\n", figures.seconds);
}

}  // namespace

std::string figures_json(const WarpFigures& figures, const WarpArguments& arguments, const WarpFrames* frames) {
  nlohmann::ordered_json json = {{"format", "pulson warp 1"},
                                 {"registration", arguments.registration},
                                 {"input", arguments.input},
                                 {"output", arguments.out},
                                 {"inverse", arguments.inverse},
                                 {"method", figures.method},
                                 {"reason", figures.reason},
                                 {"folded_fraction", figures.folded_fraction},
                                 {"min_jacobian", figures.min_jacobian},
                                 {"max_multiplicity", figures.max_multiplicity},
                                 {"uncovered_fraction", figures.uncovered_fraction},
                                 {"hole_fraction", figures.hole_fraction},
                                 {"landmark_error_max", figures.landmark_error_max},
                                 {"map_error", figures.map_error},
                                 {"labels", arguments.labels},
                                 {"ridge", figures.ridge},
                                 {"seconds", figures.seconds}};
  if (frames != nullptr) {
    json["size"] = {frames->width, frames->height};
    json["pixel_size"] = frames->input.spacing;
    json["target_pixel_size"] = frames->result.spacing;
    json["flip_y"] = frames->input.y_up;
    json["target_flip_y"] = frames->result.y_up;
    json["over"] = arguments.over;
    json["interpolation"] = arguments.interpolation;
    json["border"] = arguments.border;
    json["supersampling"] = arguments.supersampling;
    json["tolerance"] = arguments.tolerance;
    if (arguments.samples > 0) {
      json["samples"] = arguments.samples;
      json["seed"] = arguments.seed;
    }
  }
  return json.dump(1) + "\n";
}

void print_figures(const WarpFigures& figures, const WarpArguments& arguments, const WarpFrames* frames) {
  if (arguments.json == "-")
    fmt::print("{}", figures_json(figures, arguments, frames));
  else if (!arguments.json.empty())
    write_file_atomically(arguments.json, figures_json(figures, arguments, frames));
  if (arguments.json != "-" && verbosity() != Verbosity::kQuiet) print_summary(figures, arguments, frames);
}

}  // namespace pulson
