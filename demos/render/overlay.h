// Lays out title, colour bar and inset on a canvas.
#pragma once
#include "render/canvas.h"
#include "render/picture.h"

namespace penalty::render {

/// Throws std::invalid_argument for a colour bar of an empty range, or a series whose x and y differ in length.
void draw_overlay(Canvas& canvas, const Overlay& overlay, const ColorScale& colors);

}  // namespace penalty::render
