// Carries a case out.
#pragma once
#include "scenes/body_mesh.h"
#include "study/study_result.h"

namespace penalty::study {

/// On one thread, with everything its own but `body`, the mesh that the case names. What it returns is the same every
/// time, but for the times of the CPU. Throws std::invalid_argument for names that are none.
StudyResult run_case(const StudyCase& which, const demo::BodyMesh& body);

// Either kind.
StudyResult run_static_case(const StudyCase& which, const demo::BodyMesh& body);
StudyResult run_world_case(const StudyCase& which, const demo::BodyMesh& body);

}  // namespace penalty::study
