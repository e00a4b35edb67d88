#pragma once

#include "pulson/draw/pictures.hpp"
#include "results.hpp"

namespace pulson {

/// The coefficients of the models as displacements of the template, those of Procrustes coordinates beside those of
/// momenta, magnified by as much as the heading of each says.
void draw_coefficients(const AtlasResults& results, const draw::PictureFiles& files);

}  // namespace pulson
