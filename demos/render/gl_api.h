// The OpenGL 3.3 functions the renderer calls, looked up at run time: nothing GL is linked, so a program that can draw
// also starts on a machine that cannot.
#pragma once
#define GL_GLEXT_PROTOTYPES 1  // the prototypes are only named inside decltype, never called
#include <GL/glcorearb.h>

#include <functional>
#include <stdexcept>
#include <string>

namespace penalty::render {

/// One member per function; a new one needs one line here. All throw from the constructor if the driver lacks them.
class GlApi {
 public:
  using Finder = std::function<void*(const char* name)>;

  /// The context that `finder` belongs to must be current. Throws std::runtime_error naming a missing function.
  explicit GlApi(Finder finder) : finder_(std::move(finder)) {}

 private:
  /// Becomes whatever function pointer it initialises.
  struct Symbol {
    void* address;
    template <class Function>
    operator Function*() const {
      return reinterpret_cast<Function*>(address);
    }
  };
  Symbol find(const char* name) const {
    void* address = finder_(name);
    if (!address) throw std::runtime_error(std::string("the OpenGL driver has no ") + name);
    return {address};
  }
  Finder finder_;  // before the members below, which it initialises

 public:
  decltype(&::glGetString) get_string = find("glGetString");
  decltype(&::glGetError) get_error = find("glGetError");
  decltype(&::glEnable) enable = find("glEnable");
  decltype(&::glDisable) disable = find("glDisable");
  decltype(&::glViewport) viewport = find("glViewport");
  decltype(&::glClear) clear = find("glClear");
  decltype(&::glClearColor) clear_color = find("glClearColor");
  decltype(&::glBlendFunc) blend_func = find("glBlendFunc");
  decltype(&::glPolygonOffset) polygon_offset = find("glPolygonOffset");
  decltype(&::glReadPixels) read_pixels = find("glReadPixels");
  decltype(&::glPixelStorei) pixel_storei = find("glPixelStorei");
  decltype(&::glDrawArrays) draw_arrays = find("glDrawArrays");
  decltype(&::glDrawElementsInstanced) draw_elements_instanced = find("glDrawElementsInstanced");

  decltype(&::glGenTextures) gen_textures = find("glGenTextures");
  decltype(&::glBindTexture) bind_texture = find("glBindTexture");
  decltype(&::glActiveTexture) active_texture = find("glActiveTexture");
  decltype(&::glTexImage2D) tex_image_2d = find("glTexImage2D");
  decltype(&::glTexSubImage2D) tex_sub_image_2d = find("glTexSubImage2D");
  decltype(&::glTexParameteri) tex_parameteri = find("glTexParameteri");
  decltype(&::glGenSamplers) gen_samplers = find("glGenSamplers");
  decltype(&::glBindSampler) bind_sampler = find("glBindSampler");
  decltype(&::glSamplerParameteri) sampler_parameteri = find("glSamplerParameteri");

  decltype(&::glGenFramebuffers) gen_framebuffers = find("glGenFramebuffers");
  decltype(&::glBindFramebuffer) bind_framebuffer = find("glBindFramebuffer");
  decltype(&::glFramebufferTexture2D) framebuffer_texture_2d = find("glFramebufferTexture2D");
  decltype(&::glFramebufferRenderbuffer) framebuffer_renderbuffer = find("glFramebufferRenderbuffer");
  decltype(&::glCheckFramebufferStatus) check_framebuffer_status = find("glCheckFramebufferStatus");
  decltype(&::glBlitFramebuffer) blit_framebuffer = find("glBlitFramebuffer");
  decltype(&::glGenRenderbuffers) gen_renderbuffers = find("glGenRenderbuffers");
  decltype(&::glBindRenderbuffer) bind_renderbuffer = find("glBindRenderbuffer");
  decltype(&::glRenderbufferStorageMultisample) renderbuffer_storage_multisample =
      find("glRenderbufferStorageMultisample");
  decltype(&::glDrawBuffer) draw_buffer = find("glDrawBuffer");
  decltype(&::glReadBuffer) read_buffer = find("glReadBuffer");

  decltype(&::glGenBuffers) gen_buffers = find("glGenBuffers");
  decltype(&::glBindBuffer) bind_buffer = find("glBindBuffer");
  decltype(&::glBufferData) buffer_data = find("glBufferData");
  decltype(&::glGenVertexArrays) gen_vertex_arrays = find("glGenVertexArrays");
  decltype(&::glBindVertexArray) bind_vertex_array = find("glBindVertexArray");
  decltype(&::glEnableVertexAttribArray) enable_vertex_attrib_array = find("glEnableVertexAttribArray");
  decltype(&::glVertexAttribPointer) vertex_attrib_pointer = find("glVertexAttribPointer");
  decltype(&::glVertexAttribDivisor) vertex_attrib_divisor = find("glVertexAttribDivisor");

  decltype(&::glCreateShader) create_shader = find("glCreateShader");
  decltype(&::glShaderSource) shader_source = find("glShaderSource");
  decltype(&::glCompileShader) compile_shader = find("glCompileShader");
  decltype(&::glGetShaderiv) get_shaderiv = find("glGetShaderiv");
  decltype(&::glGetShaderInfoLog) get_shader_info_log = find("glGetShaderInfoLog");
  decltype(&::glDeleteShader) delete_shader = find("glDeleteShader");
  decltype(&::glCreateProgram) create_program = find("glCreateProgram");
  decltype(&::glAttachShader) attach_shader = find("glAttachShader");
  decltype(&::glLinkProgram) link_program = find("glLinkProgram");
  decltype(&::glGetProgramiv) get_programiv = find("glGetProgramiv");
  decltype(&::glGetProgramInfoLog) get_program_info_log = find("glGetProgramInfoLog");
  decltype(&::glUseProgram) use_program = find("glUseProgram");
  decltype(&::glGetUniformLocation) get_uniform_location = find("glGetUniformLocation");
  decltype(&::glUniform1i) uniform_1i = find("glUniform1i");
  decltype(&::glUniform1f) uniform_1f = find("glUniform1f");
  decltype(&::glUniform2fv) uniform_2fv = find("glUniform2fv");
  decltype(&::glUniform3fv) uniform_3fv = find("glUniform3fv");
  decltype(&::glUniformMatrix4fv) uniform_matrix_4fv = find("glUniformMatrix4fv");
};

}  // namespace penalty::render
