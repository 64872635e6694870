// Reads tetrahedral meshes: VTK, Gmsh, TetGen.
#pragma once
#include <filesystem>

#include "penalty/mesh/tet_mesh.h"

namespace penalty {

/// True for the names that `read_mesh` takes: .vtk, .vtu, .msh, .node, .ele in any case, and a stem without extension beside
/// which a .node and an .ele file lie. Does not open the file.
bool is_tetrahedral_mesh_file(const std::filesystem::path& path);

/// Reads by extension:
///   .vtk, .vtu   legacy UNSTRUCTURED_GRID, ASCII or BINARY, file versions 1 to 5.1; or XML, with data as text, base64
///                or appended, plain or compressed by zlib, in one or more pieces. Which one is seen in the file.
///   .msh         Gmsh 1, 2.x, 4.0 and 4.1, ASCII or binary; node tags may be sparse.
///   .node, .ele  TetGen; the other file of the pair is found by name, and the common stem does too. Points carry any
///                numbers, as a rule from 0 or 1.
/// `regions` and `vertex_sets` are what the file groups, by name:
///   .vtk, .vtu   regions: the cells of each value of an array of whole numbers, one a cell and at most 256 different
///                ones: "material 3" for 3 in the array `material`. Vertex sets: values but 0 on points, and on cells that
///                are no solids.
///   .msh         regions: physical volumes, by name or as "physical 3"; without any, volumes of the model if there are
///                several: "volume 3". Vertex sets: the nodes of physical points, curves and surfaces.
///   .node, .ele  regions: the first attribute of the tetrahedra, "region 3". Vertex sets: markers of points but 0,
///                "marker 3".
///
/// Tetrahedra are taken; hexahedra, prisms and pyramids are cut into tetrahedra; of elements of higher order the corners
/// count; points, lines and faces are skipped. What was changed on the way stands in `repairs`.
/// Coordinates are metres. Numbers are read the same way in every locale. Memory is bounded by the size of the file,
/// whatever its header claims. The mesh has gone through `repair`.
/// Throws MeshError with one line for everything that is wrong with the file, std::bad_alloc for lack of memory.
TetMesh read_mesh(const std::filesystem::path& path);

}  // namespace penalty
