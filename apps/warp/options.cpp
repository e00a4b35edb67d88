// The options of `pulson warp`.

#include "shell/options.hpp"

#include "arguments.hpp"
#include "shell/messages.hpp"

namespace pulson {

void WarpArguments::add_to(CLI::App& verb) {
  verb.add_option("REGISTRATION", registration, "registration.json of pulson register")->required();
  verb.add_option("INPUT", input, "image of the source (png, jpg, tif, bmp, pgm, ppm; mha, nrrd), or landmarks")
      ->required();
  verb.add_option("-o,--out", out, "the warped image; or landmarks, in the format of its extension")
      ->type_name("FILE")
      ->required();
  verb.add_option("--json", json, "write the numbers to this file; -: to standard output, and nothing else there")
      ->type_name("FILE");
  add_quiet_option(verb);
  verb.add_flag("--inverse", inverse, "map from target to source");
  only_known(verb.add_option("--labels", labels,
                             "interpolation of the displacements by noise between landmarks: metric or thin-plate")
                 ->type_name("NAME")
                 ->capture_default_str(),
             "labels");

  verb.add_option("--like", like, "image of the target: the result has its size")
      ->type_name("FILE")
      ->group("Coordinates");
  verb.add_option("--size", size, "size of the result, as in 640x480 [that of the image]")
      ->type_name("WxH")
      ->group("Coordinates");
  verb.add_option("--pixel-size", pixel_size, "landmark units per pixel of the image [1; mha, nrrd: of the file]")
      ->group("Coordinates");
  verb.add_option("--target-pixel-size", target_pixel_size, "landmark units per pixel of the result [--pixel-size]")
      ->group("Coordinates");
  verb.add_option("--origin", origin,
                  "x,y of the image's first pixel (where y points up, of its lower edge), landmark units [0,0]")
      ->type_name("X,Y")
      ->group("Coordinates");
  verb.add_option("--target-origin", target_origin, "the same for the result [--origin]")
      ->type_name("X,Y")
      ->group("Coordinates");
  // Not bound to the variable: CLI11 would set an optional to false where the flag is not given.
  verb.add_flag_function(
          "--flip-y,!--no-flip-y", [this](std::int64_t count) { flip_y = count > 0; },
          "y of the landmarks points up [if they come from a tps file]")
      ->group("Coordinates");

  only_known(verb.add_option("--method", method, "pull (needs a map that does not fold), push, or auto")
                 ->type_name("NAME")
                 ->capture_default_str()
                 ->group("Picture"),
             "method");
  verb.add_option("--over", over, "sheet on top where the map folds: least-stretched, first, label-order, or average")
      ->type_name("NAME")
      ->capture_default_str()
      ->group("Picture");
  verb.add_option("--interpolation", interpolation,
                  "nearest, linear, cubic or lanczos; label: of numbers that name regions, none of which is made up")
      ->type_name("NAME")
      ->capture_default_str()
      ->group("Picture");
  only_known(verb.add_option("--border", border,
                             "beyond the image: transparent, constant (see --background), replicate or reflect; auto: "
                             "transparent if the image has an alpha channel, else constant")
                 ->type_name("NAME")
                 ->capture_default_str()
                 ->group("Picture"),
             "border");
  verb.add_option("--background", background,
                  "what lies beyond the image: a colour r,g,b of 0 to 255, or one value in the units of the image "
                  "[white; of labels, floating-point images, mha and nrrd 0]")
      ->type_name("COLOUR")
      ->group("Picture");
  verb.add_option("--supersampling", supersampling, "samples per pixel and axis of a push-forward, 1 to 8")
      ->capture_default_str()
      ->group("Picture");
  verb.add_option("--tolerance", tolerance, "largest interpolation error of the map, pixels")
      ->capture_default_str()
      ->group("Picture");

  verb.add_option("--field", field, "displacement field (mha, nrrd)")->type_name("FILE")->group("More results");
  verb.add_option("--jacobian", jacobian,
                  "signed Jacobian on the image, as colours (png, svg, pdf) or numbers (tif, mha, nrrd)")
      ->type_name("FILE")
      ->group("More results");
  verb.add_option("--log-jacobian", log_jacobian, "its logarithm to base 2, likewise")
      ->type_name("FILE")
      ->group("More results");
  verb.add_option("--multiplicity", multiplicity, "how many points of the image land on each pixel, likewise")
      ->type_name("FILE")
      ->group("More results");
  verb.add_option("--displacement", displacement, "how far each pixel of the image moves after the alignment, likewise")
      ->type_name("FILE")
      ->group("More results");
  verb.add_option("--folds", folds, "mask of the image's pixels that are flipped (png)")
      ->type_name("FILE")
      ->group("More results");
  verb.add_option("--holes", holes, "mask of holes in the result (png)")->type_name("FILE")->group("More results");
  verb.add_option("--grid", grid, "the result with the deformed grid and the landmarks' paths (png)")
      ->type_name("FILE")
      ->group("More results");
  verb.add_option("--side-by-side", side_by_side, "image, result and --like side by side (png, svg, pdf)")
      ->type_name("FILE")
      ->group("More results");
  verb.add_option("--overlay", overlay, "the result over --like: checkerboard, blend and difference (png, svg, pdf)")
      ->type_name("FILE")
      ->group("More results");
  verb.add_option("--report", report, "a page (html) with the motion, the result over --like, drawings and numbers")
      ->type_name("FILE")
      ->group("More results");
  verb.add_flag("--numbers", numbers, "numbers of the landmarks in --side-by-side")->group("More results");
  verb.add_option("--width", width, "width of drawings in mm [about 420]")->type_name("NUMBER")->group("More results");
  verb.add_option("--dpi", dpi, "pixels per inch of png drawings")
      ->type_name("NUMBER")
      ->capture_default_str()
      ->group("More results");
  verb.add_option("--animate", animate, "the motion (gif, mp4, webp; needs ffmpeg)")
      ->type_name("FILE")
      ->group("More results");

  add_read_options(verb, reading);

  verb.add_option("--samples", samples, "number of samples of the noise, with the fitted momenta; OUT is their mean")
      ->group("Ensembles");
  verb.add_option("--seed", seed, "seed of the random numbers")->capture_default_str()->group("Ensembles");
  verb.add_option("--deviation", deviation, "standard deviation of each pixel, as colours or numbers")
      ->type_name("FILE")
      ->group("Ensembles");
  verb.add_option("--fold-probability", fold_probability, "probability that a pixel of the image is flipped")
      ->type_name("FILE")
      ->group("Ensembles");
  add_threads_option(verb);
}

}  // namespace pulson
