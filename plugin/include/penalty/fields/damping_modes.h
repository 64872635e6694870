// A damping matrix as what it is, a sum of modes: kept for many products.
#pragma once
#include <array>
#include <span>
#include <vector>

#include "penalty/math/triple.h"

namespace penalty {

/// D = sum_k g_k g_kᵀ, mode g_k over the points of one element. What walks over the elements and adds modes serves
/// twice, as with System: once to count them, see `with_pattern`, and then at each instant to add their values, in the
/// same order and without allocation. Modes of the same two particles become one, however many elements add to it:
/// all lie along the line between the two.
///
/// A mode of two, three or four points that keeps linear momentum is stored without its last gradient, minus the sum of the
/// others: its impulses cancel by construction.
class DampingModes {
 public:
  template <class Walk>
  static DampingModes with_pattern(const Walk& walk) {
    DampingModes modes;
    modes.is_counting_ = true;
    walk(modes);
    modes.end_counting();
    return modes;
  }

  /// Only the places of modes count; disabled elements must not be left out.
  bool is_counting() const { return is_counting_; }

  /// A mode of these points; `cancels`: its gradients add up to zero.
  void count(std::span<const int> stencil, bool cancels);

  /// The next mode to be added is the first again.
  void begin();
  /// The next mode is weight * g gᵀ; one column of g a point of the stencil that was counted.
  template <class Columns>
  void add(Real weight, const Columns& g) {
    const Place place = places_[next_++];
    switch (place.size) {
      case 2:
        return set(pairs_, place.index, weight, g);
      case 3:
        return set(triples_, place.index, weight, g);
      case 4:
        return set(quadruples_, place.index, weight, g);
      case shared:
        return add_shared(place.index, weight, Triple::column(g, 0));
      default:
        return set_other(place.index, weight, g);
    }
  }
  /// To be called after the last mode.
  void end();

  /// out += D v, four reals a particle.
  void add_product(const Vectors& v, Forces out) const;

  /// bounds[i] += sum_k sum_j (|g_ki|² + |g_kj|²) / 2: never less than the Gershgorin row sums of D.
  void add_bounds(std::span<Real> bounds) const;

 private:
  template <int N>
  struct Modes {
    std::vector<std::array<int, N>> stencils;
    std::vector<Real> weights;
    std::vector<std::array<Real, 4 * (N - 1)>> gradients;  // of all points but the last, padded as particles are

    void resize() {
      weights.resize(stencils.size());
      gradients.resize(stencils.size());
    }
  };
  struct Others {
    std::vector<std::size_t> begins = {0};
    std::vector<int> particles;
    std::vector<Real> weights;
    std::vector<Real> gradients;  // three a particle
  };
  struct Place {
    int size;  // of the mode, or one of the following
    int index;
  };
  static constexpr int other = 0, shared = 1;  // a pair that several elements add to

  template <int N, class Columns>
  static void set(Modes<N>& modes, int index, Real weight, const Columns& g) {
    constexpr int size = Columns::ColsAtCompileTime;
    if constexpr (size == N || size == dynamic || (N == 2 && size == 1)) {
      modes.weights[index] = weight;
      for (int k = 0; k < N - 1; ++k)
        for (int axis = 0; axis < 3; ++axis) modes.gradients[index][4 * k + axis] = g(axis, k);
    }
  }
  void add_shared(int index, Real weight, const Triple& g);
  template <class Columns>
  void set_other(int index, Real weight, const Columns& g) {
    others_.weights[index] = weight;
    Real* gradient = &others_.gradients[3 * others_.begins[index]];
    for (Eigen::Index k = 0; k < g.cols(); ++k)
      for (int axis = 0; axis < 3; ++axis) *gradient++ = g(axis, k);
  }

  void end_counting();
  void add_products_of_few(const Real* v, Real* out) const;

  std::vector<Place> places_;  // of each mode, in the order of the walk
  std::size_t next_ = 0;
  Modes<2> pairs_;
  std::vector<int> shared_pairs_;
  Modes<3> triples_;
  Modes<4> quadruples_;
  Others others_;
  bool is_counting_ = false;
};

}  // namespace penalty
