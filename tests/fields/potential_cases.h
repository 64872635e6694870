// Kinds from the list of the library, with some of a user's own, and what may be set on their elements: a new modifier
// needs one line in `modifiers()`.
#pragma once
#include <functional>

#include "fields/meshes.h"
#include "kinds/samples.h"
#include "penalty/fields/batch_loops.h"
#include "penalty/kinds/user_constraint.h"

namespace penalty::testing {

/// One element over all its particles, at rest in `rest`; throws std::invalid_argument for a rest shape that it
/// refuses.
struct KindCase {
  std::string name;
  int num_points;
  std::function<ElementBatch&(PotentialField& field, Real stiffness)> add;
  bool conserves_momentum = true;
  bool has_sign = true;  // energies of their own have none
  bool has_exact_stiffness = true;
  bool damps_along_modes = true;  // what damps all but rigid motion goes by masses, the matrix by weights
};

template <class Kind>
KindCase kind_case(std::string name, const Kind& prototype, int n = num_example_points<Kind>) {
  return {std::move(name),
          n,
          [prototype, n](PotentialField& field, Real k) -> ElementBatch& {
            StencilOf<Kind> stencil{};
            if constexpr (Kind::num_points == dynamic) stencil.resize(static_cast<std::size_t>(n));
            for (int i = 0; i < n; ++i) stencil[static_cast<std::size_t>(i)] = i;
            return field.add(prototype, std::span(&stencil, 1), k);
          },
          conserves_momentum<Kind>,
          Constraint<Kind>,
          has_hessian<Kind>,
          !HasRigidDamping<Kind>};
}

template <class... Kinds>
void append_own(std::vector<KindCase>& cases, KindList<Kinds...>) {
  (cases.push_back(kind_case(std::string(Kinds::name), example_of<Kinds>(1))), ...);
}

inline const std::vector<KindCase>& kinds() {
  static const std::vector<KindCase> cases = [] {
    std::vector<KindCase> list;
    append_own(list, OwnKinds{});
    list.push_back(kind_case("weighted shape match", ShapeMatch({1, 2, 0.5, 3}), 4));
    const auto product = [](const auto& p) {
      return (p.col(1) - p.col(0)).squaredNorm() * (p.col(2) - p.col(0)).squaredNorm();
    };
    list.push_back(
        kind_case("user constraint, differentiated", differentiated_constraint<3>(product, RestValue::relative)));
    list.push_back(kind_case(
        "user constraint, differences",
        difference_constraint<3>([product](const Points<3>& p) -> Real { return product(p); }, RestValue::relative)));
    const auto polyline = [](const auto& p) {
      auto sum = (p.col(1) - p.col(0)).squaredNorm();
      for (int i = 2; i < p.cols(); ++i) sum += (p.col(i) - p.col(i - 1)).squaredNorm();
      return sum;
    };
    list.push_back(kind_case("user constraint of any size, differentiated",
                             differentiated_constraint<dynamic>(polyline, RestValue::relative), 5));
    return list;
  }();
  return cases;
}

struct ModifierCase {
  std::string name;
  std::function<void(ElementBatch&)> apply;
  bool needs_sign = false;  // of C, which an energy of its own does not have: it has no target and is never compressed
};

inline const std::vector<ModifierCase>& modifiers() {
  static const std::vector<ModifierCase> cases{
      {"plain", [](ElementBatch&) {}},
      {"target", [](ElementBatch& b) { b.set_target(0, 0.2); }, true},
      {"stretching only", [](ElementBatch& b) { b.set_free_play(0, -infinite, 0); }},
      {"compression only", [](ElementBatch& b) { b.set_free_play(0, 0, infinite); }, true},
      {"free between", [](ElementBatch& b) { b.set_free_play(0, -0.15, 0.25); }},
      {"moved free play", [](ElementBatch& b) { b.set_target(0, -0.1), b.set_free_play(0, -0.1, 0.1); }, true},
      {"plastic", [](ElementBatch& b) { b.set_plasticity({.yield = 0.1, .creep = 5, .limit = 1}); }, true},
      {"breakable", [](ElementBatch& b) { b.set_breaking({.upper = 1e6}); }},
      {"own stiffness", [](ElementBatch& b) { b.set_stiffness(0, 17); }},
      {"own damping", [](ElementBatch& b) { b.set_damping_time(0, 0.3); }},
      {"switched off and on", [](ElementBatch& b) { b.set_enabled(0, false), b.set_enabled(0, true); }}};
  return cases;
}

using Case = std::pair<const KindCase*, const ModifierCase*>;

inline std::vector<Case> cases() {
  std::vector<Case> all;
  for (const KindCase& kind : kinds())
    for (const ModifierCase& modifier : modifiers())
      if (kind.has_sign || !modifier.needs_sign) all.emplace_back(&kind, &modifier);
  return all;
}

inline std::vector<Case> cases_where(bool KindCase::* holds) {
  std::vector<Case> some = cases();
  std::erase_if(some, [holds](const Case& c) { return !(c.first->*holds); });
  return some;
}

inline std::string case_name(const Case& c) {
  std::string name = c.first->name + "_" + c.second->name;
  for (char& letter : name)
    if (!std::isalnum(static_cast<unsigned char>(letter))) letter = '_';
  return name;
}

}  // namespace penalty::testing
