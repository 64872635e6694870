// What the passes draw into: two shadow maps, the pass, the sum of the passes, the finished picture.
#pragma once
#include <utility>

#include "render/gl_objects.h"

namespace penalty::render {

struct Target {
  GLuint framebuffer = 0, image = 0;
  int width = 0, height = 0;
};

/// Binds the target, sets the viewport and clears what `cleared` names.
void draw_into(const GlApi& gl, const Target& target, GLbitfield cleared);

struct Targets {
  /// `multisampled`: a single pass is smoothed by four samples a pixel, which need a resolved copy to be read.
  /// `shadow_sides`: of the sun's and the sky's map. `smooth_shadows`: look-ups in them interpolate.
  Targets(const GlApi& gl, int width, int height, std::pair<int, int> shadow_sides, bool multisampled,
          bool smooth_shadows);

  Target sun, sky;      // depth
  Target pass;          // linear light of one pass, with depth; multisampled: not readable
  Target resolved;      // multisampled only
  Target sum;           // 32-bit floats: 160 passes add up without banding
  Target finished;      // bytes
  GLuint compared = 0;  // sampler: shadow map as a filtered yes or no
  GLuint plain = 0;     // sampler: shadow map as depths
};

}  // namespace penalty::render
