#include "face_tree.h"

#include <BulletSoftBody/btSoftBody.h>

namespace penalty {

void keep_face_tree(btSoftBody& body) {
  btDbvt& tree = body.m_fdbvt;
  const int size = body.m_faces.size();
  if (size == 0) return;
  // The leaves know their faces by address, and the faces move when one is added.
  const btSoftBody::Face& first = body.m_faces[0];
  if (!tree.empty() && tree.m_leaves == size && first.m_leaf && first.m_leaf->data == &first) return;
  tree.clear();
  tree.m_leaves = 0;  // which that leaves as it was
  const btScalar margin = body.getCollisionShape()->getMargin();
  for (int k = 0; k < size; ++k) {
    btSoftBody::Face& face = body.m_faces[k];
    const btVector3* corners[] = {&face.m_n[0]->m_x, &face.m_n[1]->m_x, &face.m_n[2]->m_x};
    btDbvtVolume box = btDbvtVolume::FromPoints(corners, 3);
    box.Expand(btVector3(margin, margin, margin));
    face.m_leaf = tree.insert(box, &face);
  }
}

}  // namespace penalty
