// Who wants to know of contacts is told.
#include <stdexcept>
#include <utility>

#include "bullet/contact_report.h"

namespace penalty::testing {
namespace {

class ContactCallbacks : public ContactReport {};

TEST_P(ContactCallbacks, TellsWhenContactBeginsAndEnds) {
  sim.set_gravity({0, -g, 0});
  btRigidBody& ground = sim.add_ground();
  btSoftBody& jelly = add_box({0, 0.5, 0}, 0.2);
  std::vector<int> counts;
  int begun = 0, ended = 0;
  sim.penalty().set_contact_callback([&](const btSoftBody& body, std::span<const BodyContact> contacts) {
    EXPECT_EQ(&body, &jelly);
    EXPECT_EQ(contacts.size(), sim.penalty().contacts(jelly).size());
    begun += !contacts.empty() && contacts.front().is_new;
    ended += contacts.empty();
    for (const BodyContact& contact : contacts) EXPECT_EQ(contact.object, &ground);
  });
  sim.step(frame, 10);
  EXPECT_EQ(begun, 0) << "it falls";
  sim.step(frame, 60);
  EXPECT_GE(begun, 1);
  EXPECT_EQ(ended, begun - 1) << "it has come to lie";
  throw_at(jelly, {0, 2, 0});
  sim.step(frame, 5);
  EXPECT_EQ(ended, begun);
  sim.penalty().set_contact_callback({});
  sim.step(frame, 60);
  EXPECT_EQ(ended, begun);
}

TEST_P(ContactCallbacks, WhatTheCallbackThrowsGoesNoFurtherThanTheReport) {
  sim.set_gravity({0, -g, 0});
  sim.add_ground();
  btSoftBody& jelly = add_box({0, 0.0199, 0});
  btSoftBody& other = add_box({2, 0.0199, 0});
  sim.penalty().set_contact_callback([&](const btSoftBody& body, std::span<const BodyContact>) {
    if (&body == &jelly) throw std::runtime_error("a game that is over");
    throw 1;
  });
  sim.step(frame, 5);
  EXPECT_EQ(sim.penalty().report(jelly).problem, "the contact callback threw: a game that is over");
  EXPECT_NE(sim.penalty().report(other).problem, "");
  EXPECT_FALSE(contacts(jelly).empty()) << "stepped all the same";
}

TEST_P(ContactCallbacks, TheCallbackMayTakeBodiesAway) {
  sim.set_gravity({0, -g, 0});
  btRigidBody* ground = &sim.add_ground();
  std::vector<btSoftBody*> bodies(4);
  for (int k = 0; k < 4; ++k) bodies[k] = &add_box({Real(k), 0.0199, 0});
  int told = 0;
  sim.penalty().set_contact_callback([&](const btSoftBody&, std::span<const BodyContact> contacts) {
    ++told;
    if (contacts.empty()) return;
    const std::size_t size = contacts.size();
    EXPECT_EQ(contacts.front().object, told == 1 ? ground : nullptr);
    if (ground) sim.remove(*std::exchange(ground, nullptr));
    for (btSoftBody* body : std::exchange(bodies, {bodies.back()}))
      if (body != bodies.front()) sim.remove(*body);
    EXPECT_EQ(contacts.size(), size);
    EXPECT_GT(contacts.front().impulse.norm(), 0) << "still there to be read";
    if (told == 2) sim.penalty().set_contact_callback({});
  });
  sim.step(frame, 5);
  EXPECT_EQ(told, 2) << "the first, which took the ground and three bodies, itself among them, and the last";
}

INSTANTIATE_TEST_SUITE_P(World, ContactCallbacks, both_worlds(), param_name);

}  // namespace
}  // namespace penalty::testing
