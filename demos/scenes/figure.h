// A picture of the potentials themselves: nothing moves in it.
#pragma once
#include <string>
#include <vector>

#include "render/picture.h"
#include "scenes/scene_state.h"

namespace penalty::demo {

struct Figure {
  std::string name = {};     // of the file
  render::Frame frame = {};  // but for its camera
  render::Overlay overlay = {};
  render::View view = {};
  std::vector<Fact> facts = {};
};

}  // namespace penalty::demo
