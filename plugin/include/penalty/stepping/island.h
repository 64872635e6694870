// One world step of all that touches or holds one another: many explicit substeps, or one implicit one.
#pragma once
#include <array>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "penalty/contact/contact.h"
#include "penalty/fields/potential_field.h"
#include "penalty/math/affine_span.h"
#include "penalty/stepping/contact_record.h"
#include "penalty/stepping/damper.h"
#include "penalty/stepping/impact.h"
#include "penalty/stepping/joint.h"
#include "penalty/stepping/newton.h"
#include "penalty/stepping/particles.h"
#include "penalty/stepping/rigid_body.h"
#include "penalty/stepping/step_report.h"

namespace penalty {

class SurfacePair;
struct ImplicitContactScratch;
struct ParticleContactRow;
struct SurfaceScratch;

/// What a contact gave at the end of an implicit step: where the next one starts from.
struct RememberedContact {
  std::array<int, 4> particles;  // of the point, see WeightedPoint
  Vector3 normal, force;         // [N]
};

/// What a body was given in the first of the two stages of an implicit step.
struct FirstStage {
  Vector3 impulse = Vector3::Zero(), moment = Vector3::Zero();  // from outside, gravity left out; about its centre
  Real driving = 0, damping = 0;                                // work [J]
};

/// What implicit steps keep between steps.
struct ImplicitState {
  NewtonBody newton;
  std::vector<RememberedContact> contacts, contacts_at_start;  // sorted by particles
  std::vector<RememberedContact> anchors, anchors_at_start;    // likewise; normal: the point in the rigid body
  PackedVectors acceleration;                                  // mean one of the last step [m/s²]
  bool has_acceleration = false;

  // What the step works in: of the body,
  Eigen::Index first = 0;  // its first column among the island's unknowns
  FirstStage first_stage;
  // and of the island that it is the first body of.
  NewtonSolver solver;
  PackedVectors from, velocities, guess;
  PackedVectors base, carried;            // the step ends with velocities (x - base) / t, without forces `carried`
  PackedVectors stage, stage_velocities;  // where the first of two ended
  std::vector<Real> enough;
  std::shared_ptr<ImplicitContactScratch> contact_scratch;
};

/// A soft body: its state, its field and what the integrator remembers of it between steps. The field outlives the
/// body.
struct SteppedBody {
  Particles particles;
  PotentialField* field = nullptr;
  StepOptions options;
  Vector3 gravity = Vector3::Zero();  // [m/s²]
  PackedVectors external_forces;      // constant over the step [N]; empty: none
  Real largest_eigenvalue = 0;        // of M^-1 K at rest, an upper bound [1/s²]: see estimate_stability
  StepReport report;                  // of the last step
  EnergyFlows flows;                  // of all steps

  /// Forgets what was computed at earlier positions: call after changing positions, external forces or the field.
  void positions_changed() {
    forces_valid = false;
    implicit.newton.forget_stiffness();
  }

  // What the integrator keeps between steps.
  PackedVectors forces;  // at `particles.positions`, external ones included [N]
  Real elastic_energy = 0;
  bool forces_valid = false;
  EnergyFlows step_flows;           // of the attempt at the present step
  std::optional<Real> last_energy;  // at the end of the last step [J]
  int last_substeps = 0;            // what the energy guard settled on
  std::uint32_t num_steps = 0;      // begun; where a step damps follows from it
  Real mass = 0;                    // of the particles that are not pinned [kg]
  Real energy_noise = 0;            // growth of energy that means nothing [J]
  Real size = 0;                    // diagonal of the box about the rest shape [m]
  PackedVectors before_contacts;    // velocities [m/s]
  Real pressing = 0;                // sizes of the impulses of contacts along their normals, in this step [N s]
  Particles start;                  // positions and velocities to go back to,
  FieldState start_state;           // and what flowed, broke and changed phase
  AffineSpan rest_span;
  Damper damper;
  ImplicitState implicit;
};

/// A potential over points of several bodies: attachments, joints of flesh and bone. Particle i of the field is
/// points[i]. Rigid bodies get the reaction.
struct Coupling {
  std::vector<Side> points;
  PotentialField* field = nullptr;
  Real damping_time = 0;        // as in StepOptions [s]
  Real largest_eigenvalue = 0;  // see estimate_stability [1/s²]
  Real elastic_energy = 0;      // at the end of the last step [J]

  // What the integrator works in.
  bool has_driven_points = false;  // points of no mobility, which may be moved
  PackedVectors positions, velocities, previous_velocities, forces;
  std::vector<Real> inverse_masses;  // no less than the mobility of the point in any direction, whatever the others do
  FieldState start_state;
};

/// Where the surfaces of two bodies of an island, or of one, may touch, or that of a body the corners and edges of a
/// rigid one.
struct SurfaceContact {
  SurfacePair* pair = nullptr;
  int body_a = -1, body_b = -1;  // whose surfaces these are; the same: one body with itself
  int rigid = -1;                // index of the rigid body that has surface b; body_b is -1 then

  bool is_within_body() const { return body_a == body_b; }
};

/// Bodies that touch the same rigid bodies, touch each other or are coupled, and all that is between them: what has to
/// be stepped together.
struct Island {
  std::vector<SteppedBody*> bodies = {};
  std::vector<RigidBody> rigid_bodies = {};
  std::vector<Coupling*> couplings = {};
  std::vector<Contact> contacts = {};  // of this step
  std::vector<Anchor> anchors = {};
  std::vector<SurfaceContact> surfaces = {};
  std::vector<RigidContact> rigid_contacts = {};  // of this step
  std::vector<Joint> joints = {};
  JointSource* joint_source = nullptr;  // of these joints, if there are any
  std::vector<Impact> impacts = {};     // pairs that have restitution, by body, other_body, other_rigid

  std::vector<ContactRecord> records = {};  // what pressed in the last step; contacts between rigid bodies left out

  // What the integrator works in.
  std::vector<RigidBody> rigid_start = {};
  std::vector<char> touching = {};  // bodies that may touch something
  std::shared_ptr<std::vector<ParticleContactRow>> particle_contact_rows = {};
  std::shared_ptr<SurfaceScratch> surface_scratch = {};
};

/// Sets `largest_eigenvalue` from the stiffness at the rest positions of the field. Call once, and after a change of
/// masses, stiffness or elements.
void estimate_stability(SteppedBody& body);

/// Sets the inverse masses of the points and, if they changed or `anew`, `largest_eigenvalue` from the Gershgorin row
/// sums of the stiffness at the rest positions of the coupling's field: bodies turn against each other, and these do
/// not depend on directions.
void estimate_stability(Coupling& coupling, const Island& island, bool anew);

/// Advances an island over `duration` [s] and says what was done; a duration that is not positive and finite is no
/// step.
///
/// Explicitly: equal substeps of velocity Verlet (kick, drift, kick), with sweeps over the contacts before each drift and
/// after the last kick: no velocity is handed out that contacts have not seen. At the start and the end positions and
/// velocities belong to the same instant, and only there, or up to eight times a step on the way, is damping applied, see
/// Damper: touched half a substep apart, it would feed the fastest modes. What lies is settled there, too, twice a step.
/// The number of substeps follows from the stability limit 2 / sqrt(largest_eigenvalue) and the safety of each body. That
/// limit belongs to the rest shape; far from it a step may still gain energy. If kinetic + elastic energy, less the work of
/// gravity and obstacles, grows beyond the tolerance or is not finite, the step is undone and repeated with half as many
/// substeps again; the next step starts from at least 0.8 of that number. Plastic flow and breaking happen up to eight
/// times a step; what they take is no growth.
///
/// Hits of bodies with restitution are followed from step to step, and what they give back changes the velocities at the
/// end of a step.
///
/// Implicitly, soft bodies and the rigid ones that they touch, see Integrator: the positions at the end minimise
///
///     Phi(x) = sum_i m_i / 2h² |x_i - (x + h v + h² a)_i|² + E(x) + (x - x0)ᵀ D (x - x0) / 2h + contacts
///
/// by projected Newton iterations with a line search; a rigid body adds the like of the first term for its translation and
/// its rotation vector. Contacts press and rub by stiff potentials of their own, with multipliers and limits of friction that are
/// updated in between. Depth is taken back at half a metre a second at most. Where surfaces are near, no iteration moves them
/// further than a plane between each two features allows, and their contacts are taken anew on the way. Unlike that minimum, which turns too slowly,
/// the step keeps the angular momentum of a free body that touches nothing but free bodies, and the linear one in spite of
/// iterations that end early: a rigid velocity is added. Energy that would grow all the same is taken from the velocities
/// that deform the body. StepReport says how much.
///
/// Linear and angular momentum of free bodies and touched rigid ones are kept to round-off, but for the gyroscopic term
/// of a rigid body with unequal moments of inertia, which is left to Bullet. A step that cannot be made finite is
/// undone and reported, never handed on.
StepReport advance(Island& island, Real duration);

}  // namespace penalty
