// The GLSL sources. Variants are made by #define, not by uniforms: branches cost a software rasteriser a fifth.
#pragma once
#include <string>

namespace penalty::render {

enum class Kind { rigid, surface, ground };

struct SceneVariant {
  Kind kind = Kind::surface;
  bool color_mapped = false;  // surfaces only
  bool wire = false;          // surfaces only
  int taps = 16;              // of the shadow filter; 1: the bare map
  bool single_pass = true;    // one pass has to estimate penumbrae and sky; many passes sample them
};

std::string scene_vertex_shader(Kind kind);
std::string scene_fragment_shader(const SceneVariant& variant);

std::string depth_vertex_shader(Kind kind);  // rigid or surface, for shadow maps
std::string depth_fragment_shader();

std::string full_screen_vertex_shader();  // one triangle, no attributes
std::string backdrop_fragment_shader();
std::string accumulate_fragment_shader();  // adds a pass
std::string develop_fragment_shader();     // linear light to sRGB

std::string overlay_vertex_shader();
std::string overlay_fragment_shader();

}  // namespace penalty::render
