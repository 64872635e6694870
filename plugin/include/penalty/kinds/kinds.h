// THE list of kinds: a new one is its header and an entry here. The library compiles its loops, registers its name and
// runs its property tests from this list.
#pragma once
#include <type_traits>

#include "penalty/kinds/attachment.h"
#include "penalty/kinds/bending_angle.h"
#include "penalty/kinds/corner_angle.h"
#include "penalty/kinds/distance.h"
#include "penalty/kinds/enclosed_volume.h"
#include "penalty/kinds/length.h"
#include "penalty/kinds/shape_match.h"
#include "penalty/kinds/stable_neo_hookean.h"
#include "penalty/kinds/tetrahedron_dihedral_angle.h"
#include "penalty/kinds/tetrahedron_volume.h"
#include "penalty/kinds/triangle_area.h"

namespace penalty {

template <class... Kinds>
struct KindList {};

using OwnKinds = KindList<Length, TriangleArea, TetrahedronVolume, CornerAngle, TetrahedronDihedralAngle, BendingAngle,
                          Distance, Attachment, EnclosedVolume, ShapeMatch, StableNeoHookean>;

template <class Kind, class List>
inline constexpr bool is_in = false;
template <class Kind, class... Kinds>
inline constexpr bool is_in<Kind, KindList<Kinds...>> = (std::is_same_v<Kind, Kinds> || ...);

/// The place of a kind in a list that it is in.
template <class Kind, class List>
inline constexpr std::size_t index_in = 0;
template <class Kind, class... Kinds>
inline constexpr std::size_t index_in<Kind, KindList<Kinds...>> = [] {
  const bool is_there[] = {std::is_same_v<Kind, Kinds>...};
  std::size_t index = 0;
  while (index < sizeof...(Kinds) && !is_there[index]) ++index;
  return index;
}();

/// A kind of the library; any other is a user's own.
template <class Kind>
inline constexpr bool is_own_kind = is_in<Kind, OwnKinds>;

}  // namespace penalty
