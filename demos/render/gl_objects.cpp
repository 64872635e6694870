#include "render/gl_objects.h"

#include <array>
#include <cstdint>
#include <cstdio>

namespace penalty::render {

GLuint make_texture(const GlApi& gl, int width, int height, const TextureFormat& format, const void* data,
                    GLint filter) {
  GLuint texture = 0;
  gl.gen_textures(1, &texture);
  gl.bind_texture(GL_TEXTURE_2D, texture);
  gl.tex_image_2d(GL_TEXTURE_2D, 0, static_cast<GLint>(format.internal), width, height, 0, format.format, format.type,
                  data);
  for (const GLenum which : {GL_TEXTURE_MIN_FILTER, GL_TEXTURE_MAG_FILTER})
    gl.tex_parameteri(GL_TEXTURE_2D, which, filter);
  for (const GLenum which : {GL_TEXTURE_WRAP_S, GL_TEXTURE_WRAP_T})
    gl.tex_parameteri(GL_TEXTURE_2D, which, GL_CLAMP_TO_EDGE);
  return texture;
}

GLuint make_renderbuffer(const GlApi& gl, int width, int height, GLenum internal_format, int samples) {
  GLuint renderbuffer = 0;
  gl.gen_renderbuffers(1, &renderbuffer);
  gl.bind_renderbuffer(GL_RENDERBUFFER, renderbuffer);
  gl.renderbuffer_storage_multisample(GL_RENDERBUFFER, samples, internal_format, width, height);
  return renderbuffer;
}

GLuint make_framebuffer(const GlApi& gl) {
  GLuint framebuffer = 0;
  gl.gen_framebuffers(1, &framebuffer);
  gl.bind_framebuffer(GL_FRAMEBUFFER, framebuffer);
  return framebuffer;
}

void attach_texture(const GlApi& gl, GLenum attachment, GLuint texture) {
  gl.framebuffer_texture_2d(GL_FRAMEBUFFER, attachment, GL_TEXTURE_2D, texture, 0);
}

void attach_renderbuffer(const GlApi& gl, GLenum attachment, GLuint renderbuffer) {
  gl.framebuffer_renderbuffer(GL_FRAMEBUFFER, attachment, GL_RENDERBUFFER, renderbuffer);
}

void require_complete(const GlApi& gl, const char* what) {
  if (const GLenum status = gl.check_framebuffer_status(GL_FRAMEBUFFER); status != GL_FRAMEBUFFER_COMPLETE) {
    std::array<char, 96> message{};
    std::snprintf(message.data(), message.size(), "OpenGL cannot draw into the %s framebuffer (status 0x%x)", what,
                  status);
    throw std::runtime_error(message.data());
  }
}

void require_no_error(const GlApi& gl, const char* what) {
  if (const GLenum error = gl.get_error(); error != GL_NO_ERROR) {
    std::array<char, 96> message{};
    std::snprintf(message.data(), message.size(), "OpenGL error 0x%x while %s", error, what);
    throw std::runtime_error(message.data());
  }
}

void set_attribute(const GlApi& gl, GLuint index, int components, int stride, int offset, bool per_instance) {
  gl.enable_vertex_attrib_array(index);
  const auto bytes = static_cast<std::uintptr_t>(offset) * sizeof(float);
  gl.vertex_attrib_pointer(index, components, GL_FLOAT, GL_FALSE, stride * static_cast<int>(sizeof(float)),
                           reinterpret_cast<const void*>(bytes));  // NOLINT(performance-no-int-to-ptr): OpenGL's way
  gl.vertex_attrib_divisor(index, per_instance ? 1 : 0);
}

Program::Program(const GlApi& gl, const std::string& vertex_source, const std::string& fragment_source)
    : gl_(&gl), id_(gl.create_program()) {
  std::array<char, 2048> log{};
  const auto attach = [&](GLenum kind, const std::string& source) {
    const GLuint shader = gl.create_shader(kind);
    const char* text = source.c_str();
    gl.shader_source(shader, 1, &text, nullptr);
    gl.compile_shader(shader);
    GLint compiled = 0;
    gl.get_shaderiv(shader, GL_COMPILE_STATUS, &compiled);
    if (!compiled) {
      gl.get_shader_info_log(shader, log.size(), nullptr, log.data());
      throw std::runtime_error(std::string("a shader does not compile: ") + log.data());
    }
    gl.attach_shader(id_, shader);
    gl.delete_shader(shader);  // with the program
  };
  attach(GL_VERTEX_SHADER, vertex_source);
  attach(GL_FRAGMENT_SHADER, fragment_source);
  gl.link_program(id_);
  GLint linked = 0;
  gl.get_programiv(id_, GL_LINK_STATUS, &linked);
  if (!linked) {
    gl.get_program_info_log(id_, log.size(), nullptr, log.data());
    throw std::runtime_error(std::string("a shader does not link: ") + log.data());
  }
}

}  // namespace penalty::render
