// Fields of every sort, and changes of their elements.
#pragma once
#include "fuzz/chance.h"
#include "penalty/fields/potential_field.h"
#include "penalty/mesh/tet_mesh.h"

namespace penalty::testing {

/// What a user's own constraint does when it is called.
struct UserFault {
  bool throws = false, gives_nan = false;
};

/// What it throws.
struct UserError : std::runtime_error {
  UserError() : std::runtime_error("the user's constraint throws") {}
};

struct RandomField {
  PotentialField field;
  bool keeps_momentum = true;  // by law and to round-off, linear and angular
};

/// `fault` must outlive the field.
RandomField random_field(Chance& chance, const TetMesh& mesh, const UserFault& fault);

/// Changes something about the elements; may throw std::invalid_argument unless the manner is legal.
void change_elements(Chance& chance, PotentialField& field);

}  // namespace penalty::testing
