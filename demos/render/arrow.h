// Arrows and bars, made of rigid shapes.
#pragma once
#include <vector>

#include "render/picture.h"

namespace penalty::render {

/// A round bar between two points. Nothing if they coincide.
void append_bar(std::vector<RigidBody>& bodies, const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius,
                const Color& color);

/// An arrow whose tip is at `to`; `radius` of its shaft. One shorter than its head is a smaller head alone; nothing if
/// the points coincide.
void append_arrow(std::vector<RigidBody>& bodies, const Eigen::Vector3d& from, const Eigen::Vector3d& to, double radius,
                  const Color& color);

}  // namespace penalty::render
