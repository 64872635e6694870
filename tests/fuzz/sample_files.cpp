#include "fuzz/readers.h"
#include "mesh/surface_files.h"
#include "mesh/vtk_xml_files.h"

namespace penalty::testing {

std::vector<std::string> sample_files(FileFormat format) {
  switch (format) {
    case FileFormat::vtk:
      return {vtk_ascii,
              vtk_ascii + vtk_data,
              vtk_offsets,
              vtk_binary(),
              vtk_binary_offsets(),
              vtk_xml(),
              vtk_xml({.format = "binary", .long_headers = true}),
              vtk_xml({.format = "appended", .compressed = true}),
              vtk_xml({.format = "appended", .raw = true, .compressed = true, .big_endian = true})};
    case FileFormat::gmsh:
      return {gmsh_2,
              gmsh_41,
              gmsh_file("1", GmshNumbers::text),
              gmsh_file("2.2", GmshNumbers::binary),
              gmsh_file("4", GmshNumbers::text),
              gmsh_file("4", GmshNumbers::swapped),
              gmsh_file("4.1", GmshNumbers::binary),
              gmsh_prisms};
    case FileFormat::tetgen:
      return {tetgen_node + std::string(tetgen_cut) + tetgen_ele};
    case FileFormat::ply:
      return {ply, ply_binary(false), ply_binary(true)};
    case FileFormat::obj:
      return {obj};
    case FileFormat::stl:
      return {stl_ascii(), stl_binary()};
  }
  return {};
}

}  // namespace penalty::testing
