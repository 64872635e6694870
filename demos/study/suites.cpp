#include "study/suites.h"

#include <array>
#include <stdexcept>

#include "scenes/scene.h"
#include "scenes/start_shapes.h"
#include "study/study_materials.h"

namespace penalty::study {
namespace {

constexpr Real world_time = 5, quick_time = 0.5;  // simulated [s]

/// Every start but `rest` from its first seed on; `seeds` of them where they differ.
std::vector<StudyCase> every_start(const StudyCase& pattern, int seeds) {
  std::vector<StudyCase> cases;
  for (const demo::Start start : demo::all_starts()) {
    if (start == demo::Start::rest) continue;
    const std::string name(demo::name_of(start));
    for (int seed = 1; seed <= (is_random(name) ? seeds : 1); ++seed) {
      cases.push_back(pattern);
      cases.back().start = name;
      cases.back().seed = static_cast<std::uint32_t>(seed);
    }
  }
  return cases;
}

std::vector<StudyCase> one_start(StudyCase pattern, const std::string& start, int seeds) {
  std::vector<StudyCase> cases;
  pattern.start = start;
  for (int seed = 1; seed <= seeds; ++seed) {
    pattern.seed = static_cast<std::uint32_t>(seed);
    cases.push_back(pattern);
  }
  return cases;
}

void append(std::vector<StudyCase>& cases, const std::vector<StudyCase>& more) {
  cases.insert(cases.end(), more.begin(), more.end());
}

StudyCase relaxation(std::string suite, std::string material, std::string mesh) {
  return {.suite = std::move(suite),
          .method = "static",
          .precision = "double",
          .material = std::move(material),
          .mesh = std::move(mesh),
          .start = {}};
}

StudyCase in_world(std::string suite, demo::WorldKind world, std::string mesh, Real duration) {
  return {.suite = std::move(suite),
          .method = std::string(demo::name_of(world)),
          .precision = std::string(demo::bullet_precision()),
          .material = "recovering",
          .mesh = std::move(mesh),
          .start = {},
          .duration = duration};
}

struct SeededMesh {
  std::string mesh;
  int seeds;
};

std::vector<StudyCase> static_cases(const SuiteOptions& options) {
  std::vector<SeededMesh> meshes{{"kuhn2", 300}, {"box4", 100}, {"box6", 20}, {"box10", 4}};
  if (!options.file_mesh.empty()) meshes.push_back({options.file_mesh, 4});
  std::vector<StudyCase> cases;
  for (const auto& [mesh, seeds] : meshes)
    append(cases, every_start(relaxation("static", "recovering", mesh), options.seeds.value_or(seeds)));
  return cases;
}

std::vector<StudyCase> rate_cases(const SuiteOptions& options) {
  std::vector<std::string> meshes{"kuhn2", "box4"};
  if (!options.file_mesh.empty()) meshes.push_back(options.file_mesh);
  std::vector<StudyCase> cases;
  for (const StudyMaterial& material : study_materials())
    for (const std::string& mesh : meshes)
      append(cases,
             one_start(relaxation("rates", std::string(material.name), mesh), "scramble", options.seeds.value_or(100)));
  return cases;
}

std::vector<StudyCase> world_cases(const SuiteOptions& options) {
  std::vector<std::string> meshes{"box4", "box6", "box10"};
  if (!options.file_mesh.empty()) meshes.push_back(options.file_mesh);
  std::vector<StudyCase> cases;
  for (const auto world : {demo::WorldKind::classic, demo::WorldKind::deformable})
    for (const std::string& mesh : meshes)
      append(cases,
             every_start(in_world("world", world, mesh, options.time.value_or(world_time)), options.seeds.value_or(5)));
  return cases;
}

std::vector<StudyCase> speed_cases(const SuiteOptions& options) {
  std::vector<StudyCase> cases;
  append(cases, one_start(relaxation("speed", "recovering", "beam4"), "scramble", options.seeds.value_or(5)));
  append(cases, one_start(relaxation("speed", "recovering", "beam4"), "plane", 1));
  append(cases, one_start(relaxation("speed", "recovering", "beam8"), "scramble", options.seeds.value_or(1)));
  return cases;
}

std::vector<StudyCase> quick_cases(const SuiteOptions& options) {
  const int seeds = options.seeds.value_or(3);
  std::vector<StudyCase> cases;
  append(cases, every_start(relaxation("quick", "recovering", "kuhn2"), seeds));
  append(cases, every_start(relaxation("quick", "recovering", "box4"), seeds));
  for (const char* material : {"neo-hookean", "springs"})
    append(cases, one_start(relaxation("quick", material, "box4"), "scramble", seeds));
  for (const auto world : {demo::WorldKind::classic, demo::WorldKind::deformable})
    append(cases, every_start(in_world("quick", world, "box2", options.time.value_or(quick_time)), 1));
  return cases;
}

constexpr std::array<Suite, 5> list{
    {{"static", "relaxation of the default material from every start", true, false, static_cases},
     {"rates", "relaxation of every material from scrambled starts", true, false, rate_cases},
     {"world", "the default material in Bullet's worlds from every start", true, true, world_cases},
     {"speed", "relaxation of the reference beams: how fast", false, false, speed_cases},
     {"quick", "a few cases of each method", false, true, quick_cases}}};

}  // namespace

std::span<const Suite> suites() { return list; }

const Suite& find_suite(std::string_view name) {
  std::string choices;
  for (const Suite& suite : list) {
    if (suite.name == name) return suite;
    choices += (choices.empty() ? "" : ", ") + std::string(suite.name);
  }
  throw std::invalid_argument("unknown suite \"" + std::string(name) + "\", must be one of " + choices);
}

std::vector<StudyCase> shard_of(const std::vector<StudyCase>& cases, int shard, int count) {
  std::vector<StudyCase> part;
  for (std::size_t k = static_cast<std::size_t>(shard - 1); k < cases.size(); k += static_cast<std::size_t>(count))
    part.push_back(cases[k]);
  return part;
}

bool is_random(std::string_view start) {
  const Eigen::Matrix3Xd rest{{0, 1, 0, 0}, {0, 0, 1, 0}, {0, 0, 0, 1}};
  const demo::Start kind = demo::start_from_name(start);
  return demo::start_positions(rest, kind, 1) != demo::start_positions(rest, kind, 2);
}

}  // namespace penalty::study
