#include "penalty/bullet/deformable_penalty_force.h"

#include <BulletSoftBody/btSoftBody.h>

#include <algorithm>
#include <atomic>
#include <cmath>
#include <stdexcept>
#include <string>

#include "convert.h"
#include "identity.h"
#include "penalty/math/text.h"

namespace penalty {
namespace {

// Beyond Bullet's own ids: addForce merges forces of equal type.
int next_force_type() {
  static std::atomic<int> next{1000};
  return next++;
}

}  // namespace

struct DeformablePenaltyForce::Attached {
  btSoftBody* body;  // followed only while it is among those of the force
  Identity name;
  PotentialField field;
  std::string problem;
  PackedVectors positions, in, out;  // scratch, one column a node

  // Many products are asked for at the same positions; of the field, nothing changes but that elements are added.
  struct Assembled {
    System matrix;
    std::size_t num_elements = 0;
    PackedVectors at;
  };
  Assembled stiffness_matrix, damping_matrix;

  Attached(btSoftBody& soft_body, PotentialField potential_field)
      : body(&soft_body), name(Identity::of(soft_body)), field(std::move(potential_field)) {
    positions = in = out = PackedVectors::Zero(4, field.num_particles());
  }

  const System& stiffness() {
    return assemble(stiffness_matrix,
                    [this](System& system) { field.add_stiffness(positions, StiffnessModel::gauss_newton, system); });
  }
  const System& damping(Real time) {
    return assemble(damping_matrix, [&](System& system) { field.add_damping(positions, time, system); });
  }
  template <class Walk>
  const System& assemble(Assembled& assembled, const Walk& walk) {
    if (assembled.num_elements != field.num_elements()) {
      assembled.matrix = System::with_pattern(field.num_particles(), walk);
      assembled.num_elements = field.num_elements();
    } else if (assembled.at.cols() == positions.cols() && assembled.at == positions) {
      return assembled.matrix;
    }
    assembled.matrix.set_zero();
    walk(assembled.matrix);
    assembled.at = positions;
    return assembled.matrix;
  }

  void set_problem(const char* what) noexcept {
    try {
      problem = what;
    } catch (const std::bad_alloc&) {
      problem = "out of memory";  // short enough to need none
    }
  }

  void read_positions() {
    for (int i = 0; i < body->m_nodes.size(); ++i) positions.col(i).head<3>() = to_vector(body->m_nodes[i].m_q);
  }
  void read_velocities() {
    for (int i = 0; i < body->m_nodes.size(); ++i) in.col(i).head<3>() = to_vector(body->m_nodes[i].m_v);
  }
  void read(const TVStack& vectors) {
    for (int i = 0; i < body->m_nodes.size(); ++i) in.col(i).head<3>() = to_vector(vectors[body->m_nodes[i].index]);
  }
  void add_to(TVStack& vectors, Real scale) const {
    for (int i = 0; i < body->m_nodes.size(); ++i)
      vectors[body->m_nodes[i].index] += to_bullet(Vector3(scale * out.col(i).head<3>()));
  }
};

DeformablePenaltyForce::DeformablePenaltyForce(Real damping_time)
    : type_(next_force_type()), damping_time_(damping_time) {
  if (!(damping_time >= 0) || !std::isfinite(damping_time))
    throw std::invalid_argument("force: damping_time is " + to_text(damping_time) + ", must be zero or positive [s]");
}

DeformablePenaltyForce::~DeformablePenaltyForce() = default;

void DeformablePenaltyForce::attach(btSoftBody& body, PotentialField field) {
  if (field.num_particles() != body.m_nodes.size())
    throw std::invalid_argument("attach: the field has " + std::to_string(field.num_particles()) +
                                " particles, the soft body " + std::to_string(body.m_nodes.size()) + " nodes");
  if (Attached* attached = find(body)) {
    attached->field.add(std::move(field));
    return;
  }
  detach(body);  // whoever was at this address
  attached_.push_back(std::make_unique<Attached>(body, std::move(field)));
}

DeformablePenaltyForce::Attached* DeformablePenaltyForce::find(const btSoftBody& body) const {
  for (const auto& attached : attached_)
    if (attached->name.is(body)) return attached.get();
  return nullptr;
}

std::string DeformablePenaltyForce::problem(const btSoftBody& body) const {
  if (const Attached* attached = find(body)) return attached->problem;
  throw std::invalid_argument("soft body is not attached");
}

void DeformablePenaltyForce::detach(const btSoftBody& body) {
  std::erase_if(attached_, [&](const auto& attached) { return attached->body == &body; });
}

template <class Function>
void DeformablePenaltyForce::for_each_active(const Function& function) noexcept {
  for (const auto& attached : attached_) {
    if (m_softBodies.findLinearSearch(attached->body) == m_softBodies.size()) continue;  // perhaps gone
    const btSoftBody& body = *attached->body;
    if (!attached->name.is(body) || !body.isActive()) continue;
    try {
      if (body.m_nodes.size() != attached->field.num_particles())
        throw std::logic_error("the soft body has " + std::to_string(body.m_nodes.size()) + " nodes, had " +
                               std::to_string(attached->field.num_particles()) + " when it was attached");
      attached->read_positions();
      attached->out.setZero();
      function(*attached);
    } catch (const std::exception& error) {
      attached->set_problem(error.what());
    } catch (...) {
      attached->set_problem("something was thrown that is no std::exception");
    }
  }
}

void DeformablePenaltyForce::addScaledForces(btScalar scale, TVStack& force) {
  addScaledDampingForce(scale, force);
  addScaledExplicitForce(scale, force);
}

void DeformablePenaltyForce::addScaledExplicitForce(btScalar scale, TVStack& force) {
  for_each_active([&](Attached& a) {
    a.problem.clear();
    a.field.add_forces(a.positions, a.out);
    a.add_to(force, scale);
  });
}

void DeformablePenaltyForce::addScaledDampingForce(btScalar scale, TVStack& force) {
  for_each_active([&](Attached& a) {
    if (damping_time_ == 0 && !a.field.damps()) return;
    a.read_velocities();
    a.damping(damping_time_).add_product(a.in, -1, a.out);
    a.add_to(force, scale);
  });
}

void DeformablePenaltyForce::addScaledElasticForceDifferential(btScalar scale, const TVStack& dx, TVStack& df) {
  for_each_active([&](Attached& a) {
    a.read(dx);
    a.stiffness().add_product(a.in, -1, a.out);
    a.add_to(df, scale);
  });
}

void DeformablePenaltyForce::addScaledDampingForceDifferential(btScalar scale, const TVStack& dv, TVStack& df) {
  for_each_active([&](Attached& a) {
    if (damping_time_ == 0 && !a.field.damps()) return;
    a.read(dv);
    a.damping(damping_time_).add_product(a.in, -1, a.out);
    a.add_to(df, scale);
  });
}

// Of the damping time of the whole only: a preconditioner needs no more.
void DeformablePenaltyForce::buildDampingForceDifferentialDiagonal(btScalar scale, TVStack& diagonal) {
  if (damping_time_ == 0) return;
  for_each_active([&](Attached& a) {
    a.stiffness().add_diagonal(-damping_time_, a.out);
    a.add_to(diagonal, scale);
  });
}

void DeformablePenaltyForce::addScaledHessian(btScalar scale) {
  for_each_active([&](Attached& a) {
    a.stiffness().add_diagonal(Real(scale) * Real(scale), a.out);
    for (int i = 0; i < a.body->m_nodes.size(); ++i)
      for (int axis = 0; axis < 3; ++axis)
        a.body->m_nodes[i].m_effectiveMass[axis][axis] += static_cast<btScalar>(a.out(axis, i));
  });
}

double DeformablePenaltyForce::totalElasticEnergy(btScalar) {
  double sum = 0;
  for_each_active([&](Attached& a) { sum += a.field.energy(a.positions); });
  return sum;
}

// What damping takes in one step, -dt F_d . v, at the present velocities.
double DeformablePenaltyForce::totalDampingEnergy(btScalar time_step) {
  double sum = 0;
  for_each_active([&](Attached& a) {
    if (damping_time_ == 0 && !a.field.damps()) return;
    a.read_velocities();
    a.damping(damping_time_).add_product(a.in, -1, a.out);
    sum -= Real(time_step) * a.out.cwiseProduct(a.in).sum();
  });
  return sum;
}

double DeformablePenaltyForce::totalEnergy(btScalar time_step) {
  return totalElasticEnergy(time_step) + totalDampingEnergy(time_step);
}

}  // namespace penalty
