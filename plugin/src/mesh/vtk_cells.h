// Cells of VTK's unstructured grids and the data on them, on their way to a mesh.
#pragma once
#include <cstdint>
#include <string>
#include <vector>

#include "raw_mesh.h"

namespace penalty {

/// One number a cell or a point.
struct VtkArray {
  std::string name;
  bool is_integer = false;
  std::vector<double> values;
};

class VtkCells {
 public:
  std::vector<std::int64_t> begins;   // cell i: corners[begins[i]] to before corners[begins[i + 1]]
  std::vector<std::int64_t> corners;  // of all cells
  std::vector<int> lines;             // of the corners; empty if they are not known

  std::size_t size() const { return begins.empty() ? 0 : begins.size() - 1; }

  /// Adds the next cell to `mesh`, in the order of the file. Returns what is wrong with it; empty if nothing is.
  std::string add(std::int64_t type, RawMesh& mesh);

  /// Whole numbers, if they are few, group what they are given to: solids make a region of each value, points and
  /// the corners of points, lines and faces a vertex set of each but 0. Their names are that of the array and the value.
  /// Numbers of a floating-point type do so if there are at least two. All cells have been added before, and there is a
  /// value for each.
  void put_in_groups(const VtkArray& array, bool is_of_cells, RawMesh& mesh) const;

 private:
  std::vector<std::int64_t> solids_;  // their numbers in the mesh; -1: none
};

}  // namespace penalty
