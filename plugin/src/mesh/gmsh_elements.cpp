#include "gmsh_elements.h"

namespace penalty {

GmshElement gmsh_element(std::int64_t type) {
  constexpr int lower[] = {0, 2, 3, 4, 0, 0, 0, 0, 3, 6, 9, 0, 0, 0, 0, 1, 8, 0, 0, 0, 9, 10, 12, 15, 15, 21, 4, 5, 6};
  if (type > 0 && type < 29 && lower[type] > 0) {
    const bool is_line = type == 1 || type == 8 || type >= 26;
    return GmshElement{lower[type], std::nullopt, type == 15 ? 0 : is_line ? 1 : 2};
  }
  switch (type) {
    case 36:
      return GmshElement{16, std::nullopt, 2};
    case 37:
      return GmshElement{25, std::nullopt, 2};
    case 38:
      return GmshElement{36, std::nullopt, 2};
    case 4:
      return GmshElement{4, Solid::tetrahedron};
    case 11:
      return GmshElement{10, Solid::tetrahedron};
    case 29:
      return GmshElement{20, Solid::tetrahedron};
    case 30:
      return GmshElement{35, Solid::tetrahedron};
    case 31:
      return GmshElement{56, Solid::tetrahedron};
    case 5:
      return GmshElement{8, Solid::hexahedron};
    case 12:
      return GmshElement{27, Solid::hexahedron};
    case 17:
      return GmshElement{20, Solid::hexahedron};
    case 32:
      return GmshElement{22, Solid::tetrahedron};
    case 33:
      return GmshElement{28, Solid::tetrahedron};
    case 92:
      return GmshElement{64, Solid::hexahedron};
    case 93:
      return GmshElement{125, Solid::hexahedron};
    case 6:
      return GmshElement{6, Solid::prism};
    case 13:
      return GmshElement{18, Solid::prism};
    case 18:
      return GmshElement{15, Solid::prism};
    case 7:
      return GmshElement{5, Solid::pyramid};
    case 14:
      return GmshElement{14, Solid::pyramid};
    case 19:
      return GmshElement{13, Solid::pyramid};
    default:
      return {};
  }
}

}  // namespace penalty
