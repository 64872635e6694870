// A canvas on an image without OpenGL: for what is flat and drawn once.
#pragma once
#include "render/canvas.h"
#include "render/image.h"

namespace penalty::render {

/// Draws `canvas`, made for the size of `image` and with `fonts`, over what is there.
void rasterize(const Canvas& canvas, const FontAtlas& fonts, Image& image);

}  // namespace penalty::render
