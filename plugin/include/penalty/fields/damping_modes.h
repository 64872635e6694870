// A damping matrix as what it is, a sum of modes: kept for many products.
#pragma once
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "penalty/math/triple.h"

namespace penalty {

/// D = sum_k w_k g_k g_kᵀ, mode g_k over the points of one element. What walks over the elements and adds modes serves
/// twice, as with System: once to count them, see `with_pattern`, and then at each instant to add their values, in the
/// same order and without allocation.
///
/// A product with D comes many times after each walk, and many modes meet at one edge. So modes of two, three or four
/// points that keep linear momentum are summed to one block for each two particles, of which
///
///     (D v)_i = sum_j D_ij (v_j - v_i),   D_ij = sum_k w_k g_ki g_kjᵀ = D_jiᵀ
///
/// needs those of i < j only. Modes of the same two particles lie along the line between the two: they become one
/// number, however many elements add to it.
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
  /// The next mode is weight * g gᵀ, weight >= 0; one column of g a point of the stencil that was counted.
  template <class Columns>
  void add(Real weight, const Columns& g) {
    const Place place = places_[next_++];
    if (place.size == other)
      set_other(place.index, weight, g);
    else if (place.size == 2)
      add_pair(place.index, weight, Triple::column(g, 0));
    else if constexpr (Columns::ColsAtCompileTime == dynamic || Columns::ColsAtCompileTime > 2)
      set_few(place.index, place.size, weight, g);
  }
  /// To be called after the last mode.
  void end();

  /// out += D v, four reals a particle.
  void add_product(const Vectors& v, Forces out) const;

  /// bounds[i] += sum_k w_k sum_j (|g_ki|² + |g_kj|²) / 2: never less than the Gershgorin row sums of D.
  void add_bounds(std::span<Real> bounds) const;

 private:
  // The blocks above the diagonal, row by row.
  struct Blocks {
    std::vector<std::size_t> begins = {0};  // of the block rows
    std::vector<int> columns;
    std::vector<Real> values;  // nine a block: xx yy zz, xz yx zy, xy yz zx; and one that is read along with the last
    // What lies along the line between the two particles.
    std::vector<Real> along;  // w |g|²
    std::vector<std::array<Real, 4>> directions;
    // Modes of more points: one product of two of their gradients after another.
    std::vector<std::size_t> product_begins;  // of the blocks
    std::vector<std::array<int, 2>> products;
  };
  struct Others {
    std::vector<std::size_t> begins = {0};
    std::vector<int> particles;
    std::vector<Real> weights;
    std::vector<Real> gradients;  // three a particle
  };
  struct Place {
    int size;   // of the mode, or `other`
    int index;  // of its block, of its first gradient, or among the others
  };
  static constexpr int other = 0;

  void add_pair(int block, Real weight, const Triple& g) {
    blocks_.along[block] += weight * dot(g, g);
    blocks_.directions[block] = {g.x, g.y, g.z, 0};
  }
  template <class Columns>
  void set_few(int first, int size, Real weight, const Columns& g) {
    const Real root = std::sqrt(weight);
    Triple sum{0, 0, 0};
    for (int k = 0; k < size - 1; ++k) {
      const Triple scaled = Triple::column(g, k) * root;
      gradients_[first + k] = {scaled.x, scaled.y, scaled.z, 0};
      sum = sum + scaled;
    }
    gradients_[first + size - 1] = {-sum.x, -sum.y, -sum.z, 0};
  }
  template <class Columns>
  void set_other(int index, Real weight, const Columns& g) {
    others_.weights[index] = weight;
    Real* gradient = &others_.gradients[3 * others_.begins[index]];
    for (Eigen::Index k = 0; k < g.cols(); ++k)
      for (int axis = 0; axis < 3; ++axis) *gradient++ = g(axis, k);
  }

  void end_counting();

  std::vector<Place> places_;  // of each mode, in the order of the walk
  std::size_t next_ = 0;
  Blocks blocks_;
  std::vector<int> particles_;                  // of the modes of three or four points,
  std::vector<std::array<Real, 4>> gradients_;  // and sqrt(w) g, padded as particles are
  std::vector<std::array<int, 2>> pairs_;       // while counting
  Others others_;
  bool is_counting_ = false;
};

}  // namespace penalty
