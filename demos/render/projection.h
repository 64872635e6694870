// From the camera and one sample to the matrices of a pass.
#pragma once
#include "render/camera.h"
#include "render/sampling.h"
#include "render/scene.h"

namespace penalty::render {

/// The sun stands to the upper left of the picture wherever the camera is: a body is never seen from its dark side.
/// The sample shifts picture and sun and chooses the piece of sky; the sample of a single pass shifts nothing.
PassView pass_view(const Camera& camera, const UnitSpace& space, const Sample& sample,
                   const Eigen::Vector2f& resolution);

}  // namespace penalty::render
