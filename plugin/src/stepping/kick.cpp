#include "kick.h"

#include "../math/processors.h"
#include "../math/quadruple.h"

namespace penalty {
namespace {

// Whole columns, whose last number stays zero: that takes fewer instructions than three numbers. Compiled twice, as the
// loops over the elements are.
template <bool drifts>
PENALTY_TARGET_CLONES void kick_columns(const std::vector<Real>& inverse_masses, const Real* f,
                                        const Vector3& acceleration, Real kick_time, [[maybe_unused]] Real drift_time,
                                        Real* v, [[maybe_unused]] Real* x) {
  const Quadruple dv = {kick_time * acceleration[0], kick_time * acceleration[1], kick_time * acceleration[2], 0};
  for (const Real inverse_mass : inverse_masses) {
    Quadruple velocity, force;
    load_quadruple(v, velocity);
    if (inverse_mass > 0) {
      load_quadruple(f, force);
      velocity += force * (kick_time * inverse_mass) + dv;
      store_quadruple(v, velocity);
    }
    if constexpr (drifts) {
      Quadruple place;
      load_quadruple(x, place);
      store_quadruple(x, place + velocity * drift_time);
    }
    f += 4;
    v += 4;
    x += 4;
  }
}

PENALTY_TARGET_CLONES
void drift_columns(Eigen::Index size, Real time, const Real* v, Real* x) {
  Quadruple place, velocity;
  for (Eigen::Index i = 0; i < 4 * size; i += 4) {
    load_quadruple(x + i, place);
    load_quadruple(v + i, velocity);
    store_quadruple(x + i, place + velocity * time);
  }
}

}  // namespace

void kick(SteppedBody& body, Real time) {
  Particles& particles = body.particles;
  kick_columns<false>(particles.inverse_masses, body.forces.data(), body.gravity, time, 0, particles.velocities.data(),
                      particles.positions.data());
}

void drift(SteppedBody& body, Real time) {
  drift_columns(body.particles.size(), time, body.particles.velocities.data(), body.particles.positions.data());
}

void kick_and_drift(SteppedBody& body, Real kick_time, Real drift_time) {
  Particles& particles = body.particles;
  kick_columns<true>(particles.inverse_masses, body.forces.data(), body.gravity, kick_time, drift_time,
                     particles.velocities.data(), particles.positions.data());
}

}  // namespace penalty
