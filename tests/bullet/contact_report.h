// Bodies whose contacts are asked for.
#pragma once
#include "bullet/simulation.h"
#include "penalty/kinds/bending_angle.h"
#include "penalty/kinds/length.h"
#include "penalty/mesh/surface_builders.h"

namespace penalty::testing {

class ContactReport : public WorldTest {
 protected:
  std::span<const BodyContact> contacts(const btSoftBody& body) { return sim.penalty().contacts(body); }
  const Particles& particles(const btSoftBody& body) { return sim.penalty().particles(body); }

  btSoftBody& add_box(const Vector3& at, Real size = 0.5) {
    return sim.add_jelly(make_box({size, size, size}, {4, 4, 4}),
                         {.shift = at, .attach = {.step = {.damping_time = 0.05}}});
  }

  btSoftBody& add_cloth(Real size, Real margin) {
    TriangleSurface sheet = make_sheet(size, size, 8, 8);
    btSoftBody& body = sim.add(make_soft_body(sim.info(), sheet, {.mass = 0.2, .margin = margin}));
    PotentialField field(sheet.vertices);
    field.add<Length>(edges_of(std::span<const Triangle>(sheet.triangles)), 1);
    field.add<BendingAngle>(hinges_of(sheet.triangles), 1e-5);
    sim.penalty().attach(body, std::move(field));
    return body;
  }

  void throw_at(btSoftBody& body, const Vector3& velocity) {
    for (int i = 0; i < body.m_nodes.size(); ++i) body.m_nodes[i].m_v = to_bullet(velocity);
    sim.penalty().synchronize(body);
  }
};

}  // namespace penalty::testing
