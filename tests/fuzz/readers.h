// What every reader owes its caller, whatever is in the file.
#pragma once
#include <array>
#include <filesystem>
#include <string>
#include <string_view>
#include <vector>

namespace penalty::testing {

enum class FileFormat { vtk, gmsh, tetgen, ply, obj, stl };
inline constexpr std::array file_formats{FileFormat::vtk, FileFormat::gmsh, FileFormat::tetgen,
                                         FileFormat::ply, FileFormat::obj,  FileFormat::stl};

std::string name_of(FileFormat format);
FileFormat format_of(std::string_view name);  // throws std::invalid_argument

/// Between the .node and the .ele file of a pair, which go through the tests as one text.
inline constexpr std::string_view tetgen_cut = "@@\n";

/// Small good files of a format, one of each dialect.
std::vector<std::string> sample_files(FileFormat format);

/// Hands bytes to the reader of a format, as a file in a directory of its own.
class ReaderCheck {
 public:
  explicit ReaderCheck(FileFormat format);
  ~ReaderCheck();
  ReaderCheck(const ReaderCheck&) = delete;
  ReaderCheck& operator=(const ReaderCheck&) = delete;

  /// True if the bytes are a mesh or a closed surface, false if the reader refused them or the surface is open. Throws
  /// Finding if it is not what the header promises (finite vertices, indices in range, tetrahedra positively oriented, a
  /// closed surface outward, no more elements than the bytes can hold, the same mesh again when it is written and read), if the complaint is not
  /// one short printable line that begins with the name of the file, and if anything but MeshError is thrown.
  bool read(std::string_view bytes) const;

 private:
  void read_tetrahedra(std::string_view bytes) const;
  bool read_triangles(std::string_view bytes) const;
  std::filesystem::path write(const std::string& name, std::string_view bytes) const;

  FileFormat format_;
  std::filesystem::path folder_;
};

}  // namespace penalty::testing
