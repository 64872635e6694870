// What a user can get wrong ends with status 2 and one line that says it.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "demo_program.h"

namespace penalty::test {
namespace {

void expect_refusal(const Outcome& outcome, const std::string& mentions) {
  EXPECT_EQ(outcome.status, 2) << outcome.errors;
  EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << outcome.errors;
  EXPECT_TRUE(outcome.errors.starts_with("penalty-demo: ")) << outcome.errors;
  EXPECT_NE(outcome.errors.find(mentions), std::string::npos) << "\"" << mentions << "\" is not in: " << outcome.errors;
  EXPECT_EQ(outcome.output, "");
}

struct Misuse {
  const char *arguments, *mentions;
};

TEST(CommandLine, RefusesWhatItDoesNotKnow) {
  for (const Misuse& misuse :
       {Misuse{"", "subcommand"}, Misuse{"run", "scene"}, Misuse{"run nothing", "drop, beam, materials, flight"},
        Misuse{"run drop --bogus", "--bogus"}, Misuse{"run drop --world moon", "classic, deformable"},
        Misuse{"run drop --integrator rk4", "auto, explicit, implicit"}, Misuse{"run drop --order 0", "must be 1 to 2"},
        Misuse{"run drop --phases 3", "must be 1 to 2"}, Misuse{"run drop --start upside", "scramble"},
        Misuse{"run drop --gl vulkan", "osmesa"}, Misuse{"run drop --quality ultra", "preview"},
        Misuse{"run drop --model clay", "springs, springs+areas, neo-hookean"},
        Misuse{"run drop --color grey", "strain"}, Misuse{"run drop --mesh dragon", "dragon"},
        Misuse{"list all", "all"}}) {
    SCOPED_TRACE(misuse.arguments);
    expect_refusal(run_demo(words(misuse.arguments)), misuse.mentions);
  }
}

TEST(CommandLine, RefusesImpossibleNumbers) {
  for (const Misuse& misuse : {Misuse{"--rate 0", "--rate"},
                               Misuse{"--rate -60", "-60"},
                               Misuse{"--rate nan", "nan"},
                               Misuse{"--rate inf", "inf"},
                               Misuse{"--rate many", "many"},
                               Misuse{"--duration 0", "--duration"},
                               Misuse{"--duration nan", "nan"},
                               Misuse{"--duration 1e99", "steps"},
                               Misuse{"--duration 1e-9", "step"},
                               Misuse{"--stiffness 0", "--stiffness"},
                               Misuse{"--stiffness -1", "-1"},
                               Misuse{"--stiffness nan", "nan"},
                               Misuse{"--young inf", "inf"},
                               Misuse{"--poisson 0.5", "oisson"},
                               Misuse{"--young 1e5 --stiffness 1", "excludes"},
                               Misuse{"--damping -1", "--damping"},
                               Misuse{"--drag nan", "nan"},
                               Misuse{"--substeps -1", "--substeps"},
                               Misuse{"--spheres -1", "--spheres"},
                               Misuse{"--spheres 1e9", "--spheres"},
                               Misuse{"--seed -1", "--seed"},
                               Misuse{"--seeds 0", "--seeds"},
                               Misuse{"--cells 0", "--cells"},
                               Misuse{"--cells 100000", "--cells"},
                               Misuse{"--cells 0x10", "0x10"},
                               Misuse{"--stiffness 0x10", "0x10"},
                               Misuse{"--rate 1e-300 --duration 1e300", "--rate"},
                               Misuse{"--still -1", "--still"}}) {
    SCOPED_TRACE(misuse.arguments);
    expect_refusal(run_demo(words("run drop --mesh torus --no-render " + std::string(misuse.arguments))),
                   misuse.mentions);
  }
  expect_refusal(run_demo(words("run beam --cells 17")), "multiple of 4");
  expect_refusal(run_demo(words("run cloth --poisson 0.3")), "oisson");
  expect_refusal(run_demo(words("run cloth --mesh bunny")), "--mesh");
  expect_refusal(run_demo(words("run cloth --spheres 2")), "--spheres");
  expect_refusal(run_demo(words("run potential_field --cells 1")), "--cells");
  expect_refusal(run_demo(words("run tear --model springs")), "--model");
  expect_refusal(run_demo(words("run balloon --stiffness 1")), "--stiffness");
  expect_refusal(run_demo(words("run plastic --start squash")), "rest");
  expect_refusal(run_demo(words("run plastic --phases 2")), "--phases");
  expect_refusal(run_demo(words("run beam --model neo-hookean --stiffness 1")), "excludes");
  expect_refusal(run_demo(words("run beam --model springs+areas --poisson 0.26")), "oisson");
}

TEST(CommandLine, RefusesPlacesThatCannotBeWritten) {
  expect_refusal(run_demo(words("run flight --mesh box --no-render --out /dev/null/x")), "/dev/null/x");
  expect_refusal(run_demo(words("run flight --mesh box --no-render --summary /no/such/place")), "/no/such/place");
  const std::string short_run = "run flight --mesh box --cells 2 --duration 0.02 --no-render --summary ";
  expect_refusal(run_demo(words(short_run + "/dev/full")), "/dev/full");
  // The shell opens what it is told last.
  const Outcome full = run_program("sh", {"-c", PENALTY_DEMO " list >/dev/full"});
  EXPECT_EQ(full.status, 2);
  EXPECT_EQ(full.errors, "penalty-demo: standard output cannot be written\n");
}

TEST(CommandLine, LeadingZerosDoNotMakeANumberOctal) {
  const Outcome outcome = run_demo(words("run flight --mesh box --cells 010 --duration 0.02 --no-render --summary -"));
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const Outcome ten = run_demo(words("run flight --mesh box --cells 10 --duration 0.02 --no-render --summary -"));
  EXPECT_EQ(nlohmann::json::parse(outcome.output)["mesh"], nlohmann::json::parse(ten.output)["mesh"]);
}

TEST(CommandLine, RefusesBrokenMeshes) {
  const TemporaryDirectory directory;
  const std::string header = "# vtk DataFile Version 3.0\nbroken\nASCII\nDATASET UNSTRUCTURED_GRID\n",
                    points = "POINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1\n",
                    one_cell = "CELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n";
  struct Broken {
    const char* name;
    std::string text, mentions;
  };
  for (const Broken& broken :
       {Broken{"nan.vtk", header + "POINTS 4 double\n0 0 0\n1 nan 0\n0 1 0\n0 0 1\n" + one_cell, "nan"},
        Broken{"index.vtk", header + points + "CELLS 1 5\n4 0 1 2 9\nCELL_TYPES 1\n10\n", "9"},
        Broken{"flat.vtk", header + "POINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n1 1 0\n" + one_cell, "flat.vtk"},
        Broken{"empty.vtk", header + points + "CELLS 0 0\nCELL_TYPES 0\n", "empty.vtk"},
        Broken{"huge.vtk", header + "POINTS 44739242 double\n0 0 0\n", "huge.vtk"},
        Broken{"nothing.vtk", "", "nothing.vtk"},
        Broken{"lines.obj", "v 0 0 0\nv 1 0 0\nl 1 2\n", "lines.obj: the surface has no triangles"},
        Broken{"words.txt", "not a mesh", "words.txt"}}) {
    std::ofstream(directory / broken.name) << broken.text;
    SCOPED_TRACE(broken.name);
    const Outcome outcome = run_demo({"run", "drop", "--no-render", "--mesh", (directory / broken.name).string()});
    expect_refusal(outcome, broken.mentions);
  }
  const std::string sheet = (directory / "sheet.obj").string();
  std::ofstream(sheet) << "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
  for (const char* scene : {"flight", "collide", "incline", "press", "bounce", "hand", "recover"}) {
    SCOPED_TRACE(scene);
    expect_refusal(run_demo({"run", scene, "--no-render", "--mesh", sheet}),
                   "sheet.obj: an open sheet where a solid is wanted");
  }
  expect_refusal(run_demo({"run", "drop", "--no-render", "--model", "springs", "--mesh", sheet}),
                 "--model is for solids");
  expect_refusal(run_demo({"run", "drop", "--no-render", "--mesh", directory.path().string()}), "directory");
  expect_refusal(run_demo({"run", "drop", "--no-render", "--mesh", (directory / "missing.vtk").string()}),
                 "missing.vtk");
}

TEST(CommandLine, TakesAMeshOfOneTetrahedron) {
  const TemporaryDirectory directory;
  std::ofstream(directory / "one.vtk")
      << "# vtk DataFile Version 3.0\none\nASCII\nDATASET UNSTRUCTURED_GRID\n"
         "POINTS 4 double\n0 0 0\n1 0 0\n0 1 0\n0 0 1\nCELLS 1 5\n4 0 1 2 3\nCELL_TYPES 1\n10\n";
  const Outcome outcome = run_demo({"run", "drop", "--duration", "1", "--stiffness", "10", "--mesh",
                                    (directory / "one.vtk").string(), "--summary", "-"});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const auto summary = nlohmann::json::parse(outcome.output);
  EXPECT_EQ(summary["mesh"]["tetrahedra"], 1);
  EXPECT_EQ(summary["inverted"], 0);
}

TEST(CommandLine, ListsTheScenes) {
  const Outcome outcome = run_demo({"list"});
  EXPECT_EQ(outcome.status, 0);
  EXPECT_EQ(outcome.errors, "");
  for (const char* scene : {"drop", "beam", "flight", "cloth", "balloon", "muscle", "plastic", "tear",
                            "user_constraint", "potential_field"})
    EXPECT_NE(outcome.output.find(scene), std::string::npos);
}

TEST(CommandLine, ExplainsItself) {
  const Outcome outcome = run_demo({"run", "--help"});
  EXPECT_EQ(outcome.status, 0);
  for (const char* option :
       {"--world", "--integrator", "--mesh", "--stiffness", "--model", "--young", "--poisson", "--start", "--seed",
        "--seeds", "--rate", "--duration", "--out", "--quality", "--gl", "--no-render", "--summary"})
    EXPECT_NE(outcome.output.find(option), std::string::npos) << option;
}

TEST(CommandLine, ARunThatIsNotFiniteEndsWithStatus3AndItsSummary) {
  // 1e300 J a constraint overflow the forces of a stretched body.
  const Outcome outcome =
      run_demo(words("run flight --mesh box --cells 2 --stiffness 1e300 --duration 0.1 --summary -"));
  EXPECT_EQ(outcome.status, 3);
  EXPECT_EQ(std::count(outcome.errors.begin(), outcome.errors.end(), '\n'), 1) << outcome.errors;
  EXPECT_NE(outcome.errors.find("step 1 "), std::string::npos) << outcome.errors;
  EXPECT_NE(outcome.errors.find("tetrahedron "), std::string::npos) << outcome.errors;
  const auto summary = nlohmann::json::parse(outcome.output);
  EXPECT_EQ(summary["finite"], false);
  EXPECT_EQ(summary["recovered"], false);
}

}  // namespace
}  // namespace penalty::test
