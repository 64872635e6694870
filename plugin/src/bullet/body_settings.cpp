#include "body_settings.h"

#include <BulletSoftBody/btSoftBody.h>

#include <cmath>
#include <utility>

#include "penalty/math/text.h"

namespace penalty {
namespace {

Real zero_if_finite(const btVector3& v) { return 0 * Real(v.x()) + 0 * Real(v.y()) + 0 * Real(v.z()); }

}  // namespace

const char* not_finite_setting(const btSoftBody& body) {
  const btSoftBodyWorldInfo& info = *body.m_worldInfo;
  const btSoftBody::Config& config = body.m_cfg;
  const std::pair<Real, const char*> settings[] = {
      {zero_if_finite(info.m_gravity), "the gravity of its world info is not finite"},
      {Real(body.m_gravityFactor), "its gravity factor is not finite"},
      {Real(body.getCollisionShape()->getMargin()), "its collision margin is not finite"},
      {Real(config.timescale), "m_cfg.timescale is not finite"},
      {Real(config.kDF), "its friction, m_cfg.kDF, is not finite"},
      {Real(config.kDP), "m_cfg.kDP is not finite"},
      {Real(body.getRestitution()), "its restitution is not finite"},
      {Real(config.drag), "m_cfg.drag is not finite"},
      {Real(config.kDG), "m_cfg.kDG is not finite"},
      {Real(config.kLF), "m_cfg.kLF is not finite"},
      {Real(config.kPR), "m_cfg.kPR is not finite"},
      {Real(config.kVC), "m_cfg.kVC is not finite"},
      {Real(config.kMT), "m_cfg.kMT is not finite"},
      {zero_if_finite(body.m_windVelocity), "its wind velocity is not finite"},
  };
  for (const auto& [value, problem] : settings)
    if (!std::isfinite(value)) return problem;
  return nullptr;
}

void add_forces_of_settings(btSoftBody& body, Real duration) {
  const btSoftBody::Config& config = body.m_cfg;
  if (!(config.kDG > 0) && !(config.kLF > 0) && config.kPR == 0 && !(config.kVC > 0)) return;
  update_constants(body);
  body.updateNormals();
  body.m_sst.sdt = static_cast<btScalar>(duration);  // drag stops what moves through the air, at most
  body.m_sst.isdt = 1 / body.m_sst.sdt;
  body.applyForces();
}

void update_constants(btSoftBody& body) {
  if (!body.m_bUpdateRtCst) return;
  body.m_bUpdateRtCst = false;
  body.updateConstants();
}

std::vector<std::string> unused_settings(const btSoftBody& body, Real largest_margin) {
  const btSoftBody::Config& config = body.m_cfg;
  struct Setting {
    const char* name;
    btScalar value, none;  // with which it asks for nothing
    const char* instead;
  };
  constexpr const char* hard = "contacts of an attached body are hard";
  const Setting settings[] = {
      {"m_cfg.kMT", config.kMT, 0, "for pose matching add a ShapeMatch to the field"},
      {"m_cfg.timescale", config.timescale, 1,
       "a body is stepped in the time of its world: scale what stepSimulation gets"},
      {"m_cfg.kVCF", config.kVCF, 1, "velocities need no correction"},
      {"m_cfg.kCHR", config.kCHR, 1, hard},
      {"m_cfg.kKHR", config.kKHR, btScalar(0.1), hard},
      {"m_cfg.kSHR", config.kSHR, 1, hard},
      {"m_cfg.kAHR", config.kAHR, btScalar(0.7), "for a soft anchor use its influence, or couple() with an Attachment"},
      {"m_cfg.m_maxStress", config.m_maxStress, 0, "stress is what the field gives"},
      {"the rest length scale", body.m_restLengthScale, 1, "make the field from the rest shape that is wanted"},
      {"m_dampingCoefficient", body.m_dampingCoefficient, 1, "StepOptions::damping_time damps"},
      {"m_repulsionStiffness", body.m_repulsionStiffness, btScalar(0.5), hard},
  };
  std::vector<std::string> unused;
  for (const Setting& s : settings)
    if (s.value != s.none)
      unused.push_back(std::string(s.name) + " is " + to_text(Real(s.value)) + " and does nothing: " + s.instead);
  if (body.m_clusters.size() > 0) unused.emplace_back("clusters do nothing: the surface of the body touches");
  if (const Real margin = body.getCollisionShape()->getMargin(); margin > largest_margin)
    unused.push_back("the collision margin is " + to_text(margin) +
                     ", more than a quarter of the size of the body: " + to_text(largest_margin) + " is kept");
  return unused;
}

}  // namespace penalty
