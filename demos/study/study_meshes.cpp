#include "study/study_meshes.h"

#include <charconv>
#include <filesystem>
#include <stdexcept>

#include "penalty/mesh/builders.h"
#include "study/fnv.h"

namespace penalty::study {
namespace {

/// N of "<stem>N"; 0 if the name is another.
int number_after(const std::string& name, std::string_view stem) {
  if (!name.starts_with(stem)) return 0;
  int number = 0;
  const char* end = name.data() + name.size();
  const auto [rest, error] = std::from_chars(name.data() + stem.size(), end, number);
  return error == std::errc() && rest == end ? number : 0;
}

std::string hash_of(const TetMesh& mesh) {
  Fnv hash;
  hash.add(mesh.vertices.data(), sizeof(Real) * static_cast<std::size_t>(mesh.vertices.size()));
  hash.add(mesh.tetrahedra.data(), sizeof(Tetrahedron) * mesh.tetrahedra.size());
  return hash.hex().substr(0, 8);
}

}  // namespace

std::string StudyMeshes::add_file(const std::string& file) {
  demo::BodyMesh body = demo::load_body({.mesh = file}, file);
  if (body.is_shell()) throw std::invalid_argument(file + " has no tetrahedra");
  const std::string name = std::filesystem::path(file).filename().string() + "-" + hash_of(body.solid());
  meshes_.insert_or_assign(name, std::move(body));
  return name;
}

void StudyMeshes::load(const std::string& name) {
  if (meshes_.contains(name)) return;
  if (const int cells = number_after(name, "box"); cells > 0) {
    meshes_.emplace(name, demo::load_body({.mesh = "box", .cells = cells}, "box"));
  } else if (const int kuhn = number_after(name, "kuhn"); kuhn > 0) {
    TetMesh mesh = make_box({2, 2, 2}, {kuhn, kuhn, kuhn}, BoxSplit::six);
    mesh.vertices.array() -= 1;
    meshes_.emplace(name, demo::BodyMesh{std::move(mesh)});
  } else if (const int across = number_after(name, "beam"); across > 0) {
    meshes_.emplace(name, demo::BodyMesh{make_beam(across)});
  } else {
    throw std::invalid_argument("unknown mesh \"" + name + "\"");
  }
}

}  // namespace penalty::study
