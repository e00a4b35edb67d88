#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pulson/core/landmarks.hpp"
#include "pulson/draw/pictures.hpp"

namespace pulson::draw {

/// What the colours of a picture of numbers mean.
struct ColourBar {
  std::vector<std::string> colours;                    ///< #RRGGBB, from the left end to the right
  std::vector<std::pair<double, std::string>> labels;  ///< a part of the length, 0 to 1, and the text below it
  std::string mark = {};                               ///< colour of values that have none of these; may be empty
  std::string mark_label = {};
};

/// One image and what lies on it. Places are in its pixels, x to the right and y downwards, with the centre of the
/// first at (0, 0); those that miss a coordinate, or lie outside, are not drawn.
struct ImagePanel {
  std::string heading;  ///< one line, may be empty
  Raster pixels{};      ///< stretched over the panel; none: white
  int width = 0;        ///< pixels of the image, of which `pixels` may have fewer
  int height = 0;
  std::vector<Points> grid{};        ///< lines 2×M
  std::vector<Points> paths{};       ///< 2×N at each time: where the landmarks were; may be empty
  Points landmarks = Points(2, 0);   ///< 2×N, as rings
  bool is_target = false;            ///< whether these are the target's, which have another colour
  std::vector<std::string> names{};  ///< N, beside the rings; may be empty
  std::vector<ColourBar> bars{};     ///< one below the panel, or none
};

/// Images beside one another.
struct ImagePicture {
  std::vector<ImagePanel> panels;
  std::string title;     ///< one line, may be empty
  std::string subtitle;  ///< one line, may be empty
};

/// Draws the images with headings, in as many columns as make them largest, at most 1600 pixels wide; landmarks are
/// open rings, so that the image is seen within them, and a legend says what lies on the images.
///
/// @throws InputError where there is no panel, a panel has no pixels, and where a folder does not exist
void write_image_picture(const ImagePicture& picture, const PictureFiles& files);

/// The same as the bytes of a png; of `look` the width and the resolution, and the layout for narrow screens where it
/// asks for that. @throws as write_image_picture
std::string image_picture_png(const ImagePicture& picture, const PictureFiles& look);

}  // namespace pulson::draw
