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

void print_summary(const WarpRun& run) {
  const auto& [figures, arguments, frames] = run;
  const auto text = [&](std::string_view key) { return text_of(warp_facts(), key, run); };
  print_text("{} → {}\n", arguments.input, arguments.out);
  print_text("method     {}: {}\n", figures.method, figures.reason);
  print_text("map        folds {} of the {}, smallest Jacobian {}\n", text("folded_fraction"),
             frames != nullptr ? "image" : "points", text("min_jacobian"));
  if (frames != nullptr) {
    print_text("result     {} x {} pixels, at most {} per pixel, {} uncovered, {} in holes\n", frames->width,
               frames->height, counted(figures.max_multiplicity, "sheet"), text("uncovered_fraction"),
               text("hole_fraction"));
    print_text("frame      {:.4g} landmark {} per pixel, y {}\n", frames->input.unit_per_pixel[0],
               frames->input.unit_per_pixel[0] == 1 ? "unit" : "units", frames->input.y_down ? "down" : "up (flipped)");
  }
  const char* unit = frames != nullptr ? "pixels" : "units";
  print_text("accuracy   landmarks to {} {}{}\n", short_error(figures.landmark_error_max), unit,
             frames != nullptr ? fmt::format(", map to {} pixels", short_error(figures.map_error)) : "");
  if (figures.ridge > 0)
    print_text("ridge      {}: landmarks are so close that the map reproduces their noise only approximately\n",
               text("ridge"));
  for (const ColourKey& key : figures.colours) print_text("colours    {}: {}\n", key.file, key.meaning);
  print_text("seconds    {}\n", text("seconds"));
}

std::string figures_json(const WarpRun& run) {
  formats::Json json = {{"format", "pulson warp 1"}};
  add_facts(json, warp_facts(), run);
  if (const WarpFrames* const frames = run.frames) {
    json["size"] = {frames->width, frames->height};
    json["first_pixel"] = frames->first_pixel;
    json["pixel_size"] = frames->input.unit_per_pixel;
    json["target_pixel_size"] = frames->result.unit_per_pixel;
    json["frame"] = formats::frame_json(frames->input);
    json["target_frame"] = formats::frame_json(frames->result);
    add_facts(json, image_warp_facts(), run);
    if (run.arguments.samples > 0) {
      json["samples"] = run.arguments.samples;
      json["seed"] = run.arguments.seed;
    }
  }
  return records::record_text(json, 1);
}

}  // namespace

const Facts<WarpRun>& warp_facts() {
  using R = WarpRun;
  static const Facts<R> facts = {
      {"registration", "registration", "the record, or its folder", "",
       [](const R& r) { return r.arguments.registration; }},
      {"input", "input", "the image or the points", "", [](const R& r) { return r.arguments.input; }},
      {"output", "output", "the result", "", [](const R& r) { return r.arguments.out; }},
      {"inverse", "inverse", "whether the map is from target to source", "",
       [](const R& r) { return r.arguments.inverse; }},
      {"method", "method", "pull, push or points", "", [](const R& r) { return r.figures.method; }},
      {"reason", "reason", "why this one", "", [](const R& r) { return r.figures.reason; }},
      {"folded_fraction", "folded", "part of the image's pixels, or of the points, where the map folds", "{:.3g} %",
       [](const R& r) { return r.figures.folded_fraction; }, 100},
      {"min_jacobian", "smallest Jacobian", "at them, of the map from source to target", "{:.3g}",
       [](const R& r) { return defined(r.figures.min_jacobian); }},
      {"max_multiplicity", "most sheets on a pixel", "points of the image that land on one pixel", "",
       [](const R& r) { return r.figures.max_multiplicity; }},
      {"uncovered_fraction", "uncovered", "part of the result that shows nothing of the image", "{:.3g} %",
       [](const R& r) { return r.figures.uncovered_fraction; }, 100},
      {"hole_fraction", "in holes", "part of the result that the image surrounds and does not cover", "{:.3g} %",
       [](const R& r) { return r.figures.hole_fraction; }, 100},
      {"landmark_error_max", "largest error at a landmark", "pixels; of points: landmark units", "{:.2g}",
       [](const R& r) { return r.figures.landmark_error_max; }},
      {"map_error", "error of the map, pixels", "of the lattice on which it is computed, pixels", "{:.2g}",
       [](const R& r) { return r.figures.map_error; }},
      {"labels", "labels", "the kernel of landmarks' own noise (--labels)", "",
       [](const R& r) { return r.arguments.labels; }},
      {"ridge", "ridge", "of landmarks so close that their noise is reproduced only approximately, else 0", "{:.1e}",
       [](const R& r) { return r.figures.ridge; }},
      {"seconds", "seconds", "of all", "{:.3g}", [](const R& r) { return r.figures.seconds; }}};
  return facts;
}

const Facts<WarpRun>& image_warp_facts() {
  using R = WarpRun;
  static const Facts<R> facts = {
      {"flip_y", "y of landmarks points up", "in the image", "", [](const R& r) { return !r.frames->input.y_down; }},
      {"target_flip_y", "and in the result", "in the result", "", [](const R& r) { return !r.frames->result.y_down; }},
      {"over", "sheet on top", "where the map folds (--over)", "", [](const R& r) { return r.arguments.over; }},
      {"interpolation", "interpolation", "of pixels", "", [](const R& r) { return r.arguments.interpolation; }},
      {"border", "border", "what is beyond the image", "", [](const R& r) { return r.arguments.border; }},
      {"supersampling", "samples along a pixel", "of each pixel of the result, along a side", "",
       [](const R& r) { return r.arguments.supersampling; }},
      {"tolerance", "tolerance of the map", "pixels", "{:.3g}", [](const R& r) { return r.arguments.tolerance; }}};
  return facts;
}

void write_figures(const WarpRun& run) {
  const std::string& file = run.arguments.json;
  if (file == "-")
    print_exact(figures_json(run));
  else if (!file.empty())
    write_file_atomically(file, figures_json(run));
}

void print_figures(const WarpRun& run) {
  if (run.arguments.json != "-" && verbosity() != Verbosity::kQuiet) print_summary(run);
}

}  // namespace pulson
