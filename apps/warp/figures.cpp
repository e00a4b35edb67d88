#include "figures.hpp"

#include <fmt/format.h>
#include <nlohmann/json.hpp>

#include "core/atomic_file.hpp"
#include "formats/frame_text.hpp"
#include "records/record_text.hpp"
#include "shell/messages.hpp"

namespace pulson {
std::string percent_text(double part) { return fmt::format("{:.3g} %", 100 * part); }

namespace {

// Two digits; what is less than a billionth is rounding.
std::string short_error(double error) {
  constexpr double kRounding = 1e-9;
  return error > 0 && error < kRounding ? "1e-9" : fmt::format("{:.2g}", error);
}

void print_summary(const WarpFigures& figures, const WarpArguments& arguments, const WarpFrames* frames) {
  print_text("{} → {}\n", arguments.input, arguments.out);
  print_text("method     {}: {}\n", figures.method, figures.reason);
  print_text("map        folds {} of the {}, smallest Jacobian {:.3g}\n", percent_text(figures.folded_fraction),
             frames != nullptr ? "image" : "points", figures.min_jacobian);
  if (frames != nullptr) {
    print_text("result     {} x {} pixels, at most {} per pixel, {} uncovered, {} in holes\n", frames->width,
               frames->height, counted(figures.max_multiplicity, "sheet"), percent_text(figures.uncovered_fraction),
               percent_text(figures.hole_fraction));
    print_text("frame      {:.4g} landmark {} per pixel, y {}\n", frames->input.unit_per_pixel[0],
               frames->input.unit_per_pixel[0] == 1 ? "unit" : "units", frames->input.y_down ? "down" : "up (flipped)");
  }
  const char* unit = frames != nullptr ? "pixels" : "units";
  print_text("accuracy   landmarks to {} {}{}\n", short_error(figures.landmark_error_max), unit,
             frames != nullptr ? fmt::format(", map to {} pixels", short_error(figures.map_error)) : "");
  if (figures.ridge > 0)
    print_text("ridge      {:.1e}: landmarks are so close that the map reproduces their noise only approximately\n",
               figures.ridge);
  for (const ColourKey& key : figures.colours) print_text("colours    {}: {}\n", key.file, key.meaning);
  print_text("seconds    {:.3g}\n", figures.seconds);
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
                                 {"min_jacobian", records::defined_or_null(figures.min_jacobian)},
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
    json["first_pixel"] = frames->first_pixel;
    json["pixel_size"] = frames->input.unit_per_pixel;
    json["target_pixel_size"] = frames->result.unit_per_pixel;
    json["flip_y"] = !frames->input.y_down;
    json["target_flip_y"] = !frames->result.y_down;
    json["frame"] = formats::frame_json(frames->input);
    json["target_frame"] = formats::frame_json(frames->result);
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
  return records::record_text(json, 1);
}

void write_figures(const WarpFigures& figures, const WarpArguments& arguments, const WarpFrames* frames) {
  if (arguments.json == "-")
    print_exact(figures_json(figures, arguments, frames));
  else if (!arguments.json.empty())
    write_file_atomically(arguments.json, figures_json(figures, arguments, frames));
}

void print_figures(const WarpFigures& figures, const WarpArguments& arguments, const WarpFrames* frames) {
  if (arguments.json != "-" && verbosity() != Verbosity::kQuiet) print_summary(figures, arguments, frames);
}

}  // namespace pulson
