// Many cases on several threads.
#pragma once
#include <functional>
#include <vector>

#include "study/study_meshes.h"
#include "study/study_result.h"

namespace penalty::study {

/// Runs each case once, on `jobs` threads, and hands over each result as soon as it is there, in no particular order,
/// never two at a time. The meshes are loaded. What a case throws ends it all, and is thrown once the running ones are
/// done.
void run_suite(const std::vector<StudyCase>& cases, const StudyMeshes& meshes, int jobs,
               const std::function<void(const StudyResult&)>& hand_over);

}  // namespace penalty::study
