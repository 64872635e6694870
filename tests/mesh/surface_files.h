// Small surface files.
#pragma once
#include <string>

#include "mesh/files.h"
#include "mesh/surfaces.h"

namespace penalty::testing {

// A tetrahedron of volume 1/6.
inline const std::string obj = "# corner\nv 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";
inline const std::string ply =
    "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "element face 4\nproperty list uchar int vertex_indices\nend_header\n"
    "0 0 0\n1 0 0\n0 1 0\n0 0 1\n3 0 2 1\n3 0 1 3\n3 0 3 2\n3 1 2 3\n";

inline std::string stl_ascii() {
  const char* points[] = {"0 0 0", "1 0 0", "0 1 0", "0 0 1"};
  std::string text = "solid corner\n";
  for (const Triangle& t : {Triangle{0, 2, 1}, Triangle{0, 1, 3}, Triangle{0, 3, 2}, Triangle{1, 2, 3}}) {
    text += "facet normal 0 0 0\nouter loop\n";
    for (int v : t) text += std::string("vertex ") + points[v] + "\n";
    text += "endloop\nendfacet\n";
  }
  return text + "endsolid corner\n";
}

inline std::string stl_binary() {
  const TriangleSurface box = soup(boundary_surface(make_box({1, 1, 1}, {1, 1, 1})));
  std::string bytes(80, ' ');
  const auto add = [&bytes](auto value) {
    std::string raw = big_endian(value);
    bytes.append(raw.rbegin(), raw.rend());  // STL is little-endian
  };
  add(static_cast<std::uint32_t>(box.triangles.size()));
  for (const Triangle& t : box.triangles) {
    for (int k = 0; k < 3; ++k) add(0.0f);
    for (int v : t)
      for (int axis = 0; axis < 3; ++axis) add(static_cast<float>(box.vertices(axis, v)));
    bytes += std::string(2, '\0');
  }
  return bytes;
}

inline std::string ply_binary(bool big) {
  std::string text =
      replaced(ply.substr(0, ply.find("0 0 0\n")), "ascii", big ? "binary_big_endian" : "binary_little_endian");
  const auto add = [&](auto value) {
    const std::string raw = big_endian(value);
    big ? text.append(raw) : text.append(raw.rbegin(), raw.rend());
  };
  for (float x : {0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f, 0.f, 0.f, 0.f, 1.f}) add(x);
  for (const Triangle& t : {Triangle{0, 2, 1}, Triangle{0, 1, 3}, Triangle{0, 3, 2}, Triangle{1, 2, 3}}) {
    text += '\3';
    for (int v : t) add(v);
  }
  return text;
}

}  // namespace penalty::testing
