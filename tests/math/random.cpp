#include "math/random.h"

#include <Eigen/Geometry>
#include <cstdio>

namespace penalty::testing {

Vector3 Random::vector(Real size) {
  const Real x = uniform(-size, size), y = uniform(-size, size), z = uniform(-size, size);
  return {x, y, z};
}

Vector3 Random::direction() {
  Vector3 v = vector(1);
  while (v.norm() < 0.1) v = vector(1);
  return v.normalized();
}

Matrix3 Random::rotation() { return Eigen::AngleAxis<Real>(uniform(-3.1, 3.1), direction()).toRotationMatrix(); }

void WorstError::see(Real error, unsigned seed) {
  ++count_;
  if (std::isnan(error_) || error <= error_) return;
  error_ = error;
  seed_ = seed;
}

void WorstError::expect_below(Real tolerance, const std::string& law) const {
  EXPECT_GT(count_, 0) << law << ": nothing was checked";
  EXPECT_LT(error_, tolerance) << law << ", seed " << seed_;
  std::string key = law;
  for (char& c : key)
    if (c == ' ') c = '_';
  char text[32];
  std::snprintf(text, sizeof text, "%.2g", error_);
  ::testing::Test::RecordProperty(key, text);
}

}  // namespace penalty::testing
