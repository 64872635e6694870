#include "study/study_case.h"

#include "penalty/math/text.h"

namespace penalty::study {

std::string StudyCase::run() const {
  return is_static() ? method : method + " " + precision + " " + to_text(duration) + " s";
}

std::string StudyCase::id() const {
  return suite + "/" + run() + "/" + material + "/" + mesh + "/" + start + "/" + std::to_string(seed);
}

}  // namespace penalty::study
