// What came of a case, and its line in a file.
#pragma once
#include <optional>
#include <string>

#include "scenes/shape_measure.h"
#include "study/study_case.h"

namespace penalty::study {

struct StudyResult {
  StudyCase which;
  int vertices = 0, tetrahedra = 0;
  Real rest_error = 0;                        // at the end, see ShapeMeasure; NaN if a position is not finite
  std::optional<Real> rest_error_at_5s = {};  // of a longer run in a world
  int inverted = 0;                           // tetrahedra, at the end
  std::optional<Real> to_recover = {};        // iterations, or simulated time [s], until recovered for good
  int iterations = 0;                         // Newton's, all in all; steps of the world
  std::string end = {};                       // how a relaxation ended; of a world: "finite" or "not finite"
  std::string positions_hash = {};            // FNV-1a of the bits of the positions at the end, x y z of each vertex

  // What differs from run to run.
  Real cpu_seconds = 0;  // of the thread, without measuring
  std::optional<Real> cpu_seconds_to_recover = {};

  bool recovered() const { return rest_error < recovered_below; }

  /// The same but for times of the CPU.
  bool agrees_with(const StudyResult& other) const;
};

/// Fills in what the positions at the end say.
void measure_end(StudyResult& result, const demo::ShapeMeasure& measure, const PackedVectors& x);

/// JSON without line breaks.
std::string to_line(const StudyResult& result);

/// Throws std::runtime_error for a line that is no result.
StudyResult from_line(const std::string& line);

}  // namespace penalty::study
