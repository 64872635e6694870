#include "render/targets.h"

namespace penalty::render {
namespace {

Target depth_target(const GlApi& gl, int side) {
  Target target{0, make_texture(gl, side, side, depth, nullptr, GL_LINEAR), side, side};
  target.framebuffer = make_framebuffer(gl);
  attach_texture(gl, GL_DEPTH_ATTACHMENT, target.image);
  gl.draw_buffer(GL_NONE);
  gl.read_buffer(GL_NONE);
  require_complete(gl, "shadow");
  return target;
}

Target color_target(const GlApi& gl, int width, int height, const TextureFormat& format, const char* what,
                    bool with_depth = false) {
  Target target{0, make_texture(gl, width, height, format, nullptr, GL_NEAREST), width, height};
  target.framebuffer = make_framebuffer(gl);
  attach_texture(gl, GL_COLOR_ATTACHMENT0, target.image);
  if (with_depth)
    attach_renderbuffer(gl, GL_DEPTH_ATTACHMENT, make_renderbuffer(gl, width, height, GL_DEPTH_COMPONENT24, 0));
  require_complete(gl, what);
  return target;
}

Target multisampled_target(const GlApi& gl, int width, int height) {
  constexpr int samples = 4;
  Target target{make_framebuffer(gl), 0, width, height};
  attach_renderbuffer(gl, GL_COLOR_ATTACHMENT0, make_renderbuffer(gl, width, height, GL_RGBA16F, samples));
  attach_renderbuffer(gl, GL_DEPTH_ATTACHMENT, make_renderbuffer(gl, width, height, GL_DEPTH_COMPONENT24, samples));
  require_complete(gl, "multisampled");
  return target;
}

GLuint make_sampler(const GlApi& gl, GLint filter, bool compare) {
  GLuint sampler = 0;
  gl.gen_samplers(1, &sampler);
  gl.sampler_parameteri(sampler, GL_TEXTURE_MIN_FILTER, filter);
  gl.sampler_parameteri(sampler, GL_TEXTURE_MAG_FILTER, filter);
  gl.sampler_parameteri(sampler, GL_TEXTURE_WRAP_S, GL_CLAMP_TO_EDGE);
  gl.sampler_parameteri(sampler, GL_TEXTURE_WRAP_T, GL_CLAMP_TO_EDGE);
  if (compare) {
    gl.sampler_parameteri(sampler, GL_TEXTURE_COMPARE_MODE, GL_COMPARE_REF_TO_TEXTURE);
    gl.sampler_parameteri(sampler, GL_TEXTURE_COMPARE_FUNC, GL_LEQUAL);
  }
  return sampler;
}

}  // namespace

void draw_into(const GlApi& gl, const Target& target, GLbitfield cleared) {
  gl.bind_framebuffer(GL_FRAMEBUFFER, target.framebuffer);
  gl.viewport(0, 0, target.width, target.height);
  if (cleared) gl.clear(cleared);
}

Targets::Targets(const GlApi& gl, int width, int height, std::pair<int, int> shadow_sides, bool multisampled,
                 bool smooth_shadows)
    : sun(depth_target(gl, shadow_sides.first)),
      sky(depth_target(gl, shadow_sides.second)),
      pass(multisampled ? multisampled_target(gl, width, height)
                        : color_target(gl, width, height, half_float_rgba, "pass", true)),
      finished(color_target(gl, width, height, byte_rgba, "finished")),
      // A filter of several turned taps hides the texels by itself; interpolating each would cost a third of the pass.
      compared(make_sampler(gl, smooth_shadows ? GL_LINEAR : GL_NEAREST, true)),
      plain(make_sampler(gl, GL_NEAREST, false)) {
  if (multisampled)
    resolved = color_target(gl, width, height, half_float_rgba, "resolved");
  else
    sum = color_target(gl, width, height, float_rgba, "sum");
}

}  // namespace penalty::render
