// Textures, framebuffers and programs, checked when they are made. None is deleted one by one: each lives exactly as
// long as the context, which frees them all.
#pragma once
#include <Eigen/Core>
#include <string>

#include "render/gl_api.h"

namespace penalty::render {

struct TextureFormat {
  GLenum internal;  // what the driver stores
  GLenum format;    // what `data` holds
  GLenum type;
};

inline constexpr TextureFormat half_float_rgba{GL_RGBA16F, GL_RGBA, GL_FLOAT};
inline constexpr TextureFormat float_rgba{GL_RGBA32F, GL_RGBA, GL_FLOAT};
inline constexpr TextureFormat float_rgb{GL_RGB32F, GL_RGB, GL_FLOAT};
inline constexpr TextureFormat byte_rgba{GL_RGBA8, GL_RGBA, GL_UNSIGNED_BYTE};
inline constexpr TextureFormat byte_red{GL_R8, GL_RED, GL_UNSIGNED_BYTE};
inline constexpr TextureFormat depth{GL_DEPTH_COMPONENT24, GL_DEPTH_COMPONENT, GL_FLOAT};

/// Edges clamp. `data` may be null: contents undefined.
GLuint make_texture(const GlApi& gl, int width, int height, const TextureFormat& format, const void* data,
                    GLint filter);

/// `samples` 0: one sample a pixel.
GLuint make_renderbuffer(const GlApi& gl, int width, int height, GLenum internal_format, int samples);

GLuint make_framebuffer(const GlApi& gl);  // leaves it bound
void attach_texture(const GlApi& gl, GLenum attachment, GLuint texture);
void attach_renderbuffer(const GlApi& gl, GLenum attachment, GLuint renderbuffer);

/// Throws std::runtime_error unless the bound framebuffer can be drawn into.
void require_complete(const GlApi& gl, const char* what);

/// Throws std::runtime_error if OpenGL has noted an error since the last call.
void require_no_error(const GlApi& gl, const char* what);

/// Float attribute `index` of the bound vertex array, out of the bound buffer; `stride` and `offset` in floats.
void set_attribute(const GlApi& gl, GLuint index, int components, int stride, int offset, bool per_instance = false);

/// A linked pair of shaders. Names that the compiler optimised away may still be set.
class Program {
 public:
  /// Throws std::runtime_error with the compiler's message.
  Program(const GlApi& gl, const std::string& vertex_source, const std::string& fragment_source);

  void use() const { gl_->use_program(id_); }
  // The program must be in use.
  void set(const char* name, int value) const { gl_->uniform_1i(location(name), value); }
  void set(const char* name, float value) const { gl_->uniform_1f(location(name), value); }
  void set(const char* name, const Eigen::Vector2f& value) const { gl_->uniform_2fv(location(name), 1, value.data()); }
  void set(const char* name, const Eigen::Vector3f& value) const { gl_->uniform_3fv(location(name), 1, value.data()); }
  void set(const char* name, const Eigen::Matrix4f& value) const {
    gl_->uniform_matrix_4fv(location(name), 1, GL_FALSE, value.data());
  }

 private:
  GLint location(const char* name) const { return gl_->get_uniform_location(id_, name); }
  const GlApi* gl_;
  GLuint id_;
};

}  // namespace penalty::render
