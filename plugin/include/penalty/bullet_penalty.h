// Everything an application includes to put penalty forces on its Bullet soft bodies.
#pragma once
#include "penalty/assembly/potential_field.h"
#include "penalty/bullet/deformable_penalty_force.h"
#include "penalty/bullet/penalty_deformable_body_solver.h"
#include "penalty/bullet/penalty_soft_body_solver.h"
#include "penalty/bullet/soft_body.h"
#include "penalty/constraints/user_constraint.h"
#include "penalty/mesh/builders.h"
#include "penalty/mesh/embed.h"
#include "penalty/mesh/read_mesh.h"
#include "penalty/mesh/surface_builders.h"
#include "penalty/mesh/write_mesh.h"
