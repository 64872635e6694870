// Where each pass of a picture looks from: a point inside the pixel, one on the sun's disc, one in the sky.
#pragma once
#include <Eigen/Core>
#include <vector>

namespace penalty::render {

struct Sample {
  Eigen::Vector2f pixel;  // shift of the camera, -0.5 to 0.5 pixels
  Eigen::Vector2f disc;   // inside the unit disc
  Eigen::Vector3f sky;    // unit, y > 0, uniform over the hemisphere
  Eigen::Vector2f noise;  // 0 to 1, turns the shadow filter
};

/// The same set for every frame: a clip then does not flicker. For one sample: the middle of everything.
std::vector<Sample> sample_set(int count);

}  // namespace penalty::render
