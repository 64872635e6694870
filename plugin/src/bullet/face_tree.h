// Bullet's tree over the faces of a soft body, which its ray tests search.
#pragma once
class btSoftBody;

namespace penalty {

/// Gives the body a tree over its faces if it has none, or one from before faces were added. Bullet's own construction
/// takes quadratic time, and never ends where faces or links do not connect all: with this tree it is not begun.
void keep_face_tree(btSoftBody& body);

}  // namespace penalty
