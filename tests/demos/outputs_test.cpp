// What a run leaves: the summary with its promised keys, the table, the curves, the pictures.
#include <gtest/gtest.h>
#include <png.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <set>

#include "demo_program.h"

namespace penalty::test {
namespace {

using Json = nlohmann::json;

struct Picture {
  unsigned width = 0, height = 0;
  std::vector<unsigned char> rgb;
};

Picture read_png(const std::filesystem::path& path) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  Picture picture;
  if (!png_image_begin_read_from_file(&image, path.c_str())) return picture;
  image.format = PNG_FORMAT_RGB;
  picture.rgb.resize(PNG_IMAGE_SIZE(image));
  if (!png_image_finish_read(&image, nullptr, picture.rgb.data(), 0, nullptr)) return {};
  picture.width = image.width;
  picture.height = image.height;
  return picture;
}

Json summary_of(const std::string& arguments) {
  const Outcome outcome = run_demo(words(arguments + " --no-render --summary -"));
  EXPECT_EQ(outcome.status, 0) << outcome.errors;
  return Json::parse(outcome.output);  // fails unless the JSON is alone
}

TEST(Description, HasNumbersForPeople) {
  EXPECT_EQ(unreadable_numbers("a 14.394168999999998 ms, b 0.00012345 J, c 123.45, d 3.2e-09, e 100000"),
            (std::vector<std::string>{"14.394168999999998", "100000"}));
  for (const char* run : {"drop --mesh box --cells 4 --duration 0.2", "flight --duration 0.2", "beam --duration 2",
                          "cloth --duration 0.1", "potential_field"}) {
    const Outcome outcome = run_demo(words(std::string("run ") + run + " --no-render"));
    EXPECT_EQ(outcome.status, 0) << outcome.errors;
    EXPECT_GT(std::count(outcome.output.begin(), outcome.output.end(), '\n'), 3) << outcome.output;
    EXPECT_EQ(unreadable_numbers(outcome.output), std::vector<std::string>{}) << outcome.output;
  }
}

TEST(Summary, HasThePromisedKeys) {
  const Json summary = summary_of("run drop --mesh box --cells 4 --stiffness 1 --duration 0.2 --seed 7");
  for (const char* key : {"scene", "world", "integrator", "precision"}) EXPECT_TRUE(summary[key].is_string()) << key;
  for (const char* key : {"seed", "steps", "inverted"}) EXPECT_TRUE(summary[key].is_number_integer()) << key;
  for (const char* key : {"dt", "rest_error", "volume_error_peak_mean", "largest_energy_gain", "penetration"})
    EXPECT_TRUE(summary[key].is_number()) << key;
  for (const char* key : {"finite", "recovered"}) EXPECT_TRUE(summary[key].is_boolean()) << key;
  EXPECT_TRUE(summary["mesh"]["source"].is_string());
  for (const char* key : {"vertices", "tetrahedra", "triangles", "edges"})
    EXPECT_TRUE(summary["mesh"][key].is_number_integer()) << key;
  for (const char* key : {"median", "max"}) EXPECT_GT(summary["ms_per_step"][key], 0) << key;
  for (const char* key : {"initial", "peak", "final"}) EXPECT_TRUE(summary["energy"][key].is_number()) << key;
  for (const char* error : {"length_error", "volume_error"})
    for (const char* key : {"mean", "max"}) EXPECT_TRUE(summary[error][key].is_number()) << error;
  EXPECT_TRUE(summary["momentum"]["linear"].is_null());  // gravity acts
  EXPECT_TRUE(summary["momentum"]["angular"].is_null());

  EXPECT_EQ(summary["scene"], "drop");
  EXPECT_EQ(summary["integrator"], "explicit");
  EXPECT_EQ(summary["precision"], PENALTY_PRECISION);
  EXPECT_EQ(summary["seed"], 7);
  EXPECT_EQ(summary["steps"], 12);
  EXPECT_EQ(summary["mesh"]["tetrahedra"], 5 * 4 * 4 * 4);
  EXPECT_EQ(summary["finite"], true);
}

TEST(Summary, OfAShellHasNoVolumes) {
  const Json summary = summary_of("run cloth --cells 8 --duration 0.2");
  EXPECT_EQ(summary["mesh"]["tetrahedra"], 0);
  EXPECT_EQ(summary["mesh"]["triangles"], 128);
  EXPECT_EQ(summary["mesh"]["vertices"], 81);
  EXPECT_EQ(summary["mesh"]["edges"], 81 + 128 - 1);
  EXPECT_TRUE(summary["volume_error"]["mean"].is_null());
  EXPECT_TRUE(summary["volume_error"]["max"].is_null());
  EXPECT_TRUE(summary["length_error"]["mean"].is_number());
  EXPECT_EQ(summary["inverted"], 0);
  EXPECT_TRUE(summary["sag"].is_number());
  EXPECT_FALSE(summary.contains("tip_drop"));
  EXPECT_EQ(summary["finite"], true);
}

TEST(Summary, HasTheLedgerOfTheRun) {
  const Json ledger = summary_of("run tear --cells 8 --duration 1")["ledger"];
  ASSERT_EQ(ledger["batches"].size(), 1u);
  const Json& springs = ledger["batches"][0];
  EXPECT_EQ(springs["name"], "length");
  EXPECT_LT(springs["enabled"], springs["elements"]);
  for (const char* key : {"mean", "max"}) EXPECT_TRUE(springs["strain"][key].is_number()) << key;
  for (const char* key : {"constant_forces", "contacts", "couplings", "driving", "changes", "damping", "drag",
                          "inelastic", "contact_loss"})
    EXPECT_TRUE(ledger["flows"][key].is_number()) << key;
  EXPECT_GT(ledger["flows"]["driving"], 0);
  EXPECT_GT(ledger["flows"]["inelastic"], 0);
  EXPECT_LT(ledger["residual"], 0.01);
}

TEST(Summary, OfAFigureHasTheSameKeysAndItsFacts) {
  const Json run = summary_of("run flight --mesh box --cells 2 --duration 0.1");
  const Json summary = summary_of("run potential_field --cells 16");
  for (const char* key :
       {"scene", "world", "integrator", "precision", "mesh", "seed", "dt", "steps", "ms_per_step", "energy",
        "rest_error", "length_error", "volume_error", "inverted", "momentum", "finite", "recovered"}) {
    EXPECT_TRUE(run.contains(key)) << key;
    EXPECT_TRUE(summary.contains(key)) << key;
  }
  EXPECT_EQ(summary["finite"], true);
  EXPECT_LT(summary["largest_volume_force_error"], 1e-12);
}

TEST(Summary, NamesTheWorld) {
  for (const char* world : {"classic", "deformable"})
    EXPECT_EQ(summary_of(std::string("run flight --mesh box --cells 2 --duration 0.1 --world ") + world)["world"],
              world);
}

TEST(Summary, CountsRecoveredRuns) {
  const Json summary =
      summary_of("run flight --mesh box --cells 4 --stiffness 1 --start squash --duration 4 --seed 3 --seeds 3");
  EXPECT_EQ(summary["runs"], 3);
  EXPECT_EQ(summary["recovered_runs"], 3);
  EXPECT_EQ(summary["recovered"], true);
  EXPECT_LT(summary["rest_error"], 1e-2);
}

TEST(Summary, TheBeamHangsAsDeepAsItShould) {
  for (const char* world : {"classic", "deformable"}) {
    const Json summary = summary_of(std::string("run beam --cells 16 --world ") + world);
    EXPECT_NEAR(summary["tip_drop"], 0.2720, 0.0027) << world;  // one per cent of a converged integration
    EXPECT_EQ(summary["inverted"], 0);
  }
}

TEST(Summary, IsTheSameForTheSameSeed) {
  const std::string run = "run drop --mesh ball --cells 6 --stiffness 1 --duration 1 --seed ";
  Json one = summary_of(run + "5"), same = summary_of(run + "5"), other = summary_of(run + "6");
  for (Json* json : {&one, &same, &other}) json->erase("ms_per_step");
  EXPECT_EQ(one, same);
  EXPECT_NE(one["energy"], other["energy"]);
}

TEST(Outputs, DataNeedsNoOpenGL) {
  const TemporaryDirectory directory;
  const Outcome outcome = run_demo({"run", "flight", "--mesh", "box", "--cells", "2", "--duration", "0.5",
                                    "--no-render", "--out", (directory / "new/place").string()});
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  std::set<std::string> files;
  for (const auto& entry : std::filesystem::directory_iterator(directory / "new/place"))
    files.insert(entry.path().filename().string());
  EXPECT_EQ(files, (std::set<std::string>{"summary.json", "energies.csv", "energies.svg"}));
  EXPECT_EQ(Json::parse(contents(directory / "new/place/summary.json"))["steps"], 30);
  const std::string csv = contents(directory / "new/place/energies.csv");
  EXPECT_EQ(std::count(csv.begin(), csv.end(), '\n'), 1 + 1 + 30);  // names, start, steps
  EXPECT_TRUE(csv.starts_with("time,elastic,kinetic,")) << csv.substr(0, 80);
  const std::string names = csv.substr(0, csv.find('\n')), first = csv.substr(names.size() + 1);
  for (const char* name : {",damping,", ",contact_loss,", ",length_energy,", ",tetrahedron_volume_strain_max"})
    EXPECT_NE(names.find(name), std::string::npos) << name;
  EXPECT_EQ(std::count(names.begin(), names.end(), ','),
            std::count(first.begin(), first.begin() + static_cast<std::ptrdiff_t>(first.find('\n')), ','));
  EXPECT_NE(contents(directory / "new/place/energies.svg").find("<svg"), std::string::npos);
}

TEST(Outputs, PicturesShowTheScene) {
  const TemporaryDirectory directory;
  const Outcome outcome = run_demo({"run", "drop", "--mesh", "ball", "--cells", "6", "--stiffness", "1", "--duration",
                                    "0.2", "--out", directory.path().string()},
                                   "LP_NUM_THREADS=1");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  const Picture still = read_png(directory / "drop.png");
  ASSERT_EQ(still.width, 640u);
  ASSERT_EQ(still.height, 360u);
  std::set<unsigned> colors;
  for (std::size_t i = 0; i + 2 < still.rgb.size(); i += 3)
    colors.insert(still.rgb[i] << 16 | still.rgb[i + 1] << 8 | still.rgb[i + 2]);
  EXPECT_GT(colors.size(), 1000u);  // a blank picture has one, a backdrop some hundred
  if (std::filesystem::exists(directory / "drop.mp4")) {
    const std::string clip = contents(directory / "drop.mp4");
    EXPECT_GT(clip.size(), 2000u);
    EXPECT_EQ(clip.substr(4, 4), "ftyp");
  } else {  // without ffmpeg its frames
    EXPECT_NE(outcome.errors.find("ffmpeg"), std::string::npos) << outcome.errors;
  }
}

TEST(Outputs, AFigureLeavesAStillOfEachAndAClip) {
  const TemporaryDirectory directory;
  const Outcome outcome =
      run_demo({"run", "potential_field", "--cells", "16", "--duration", "0.2", "--out", directory.path().string()},
               "LP_NUM_THREADS=1");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  for (const char* name : {"potential_field.png", "volume_force.png"})
    EXPECT_EQ(read_png(directory / name).width, 640u) << name;
  EXPECT_TRUE(std::filesystem::exists(directory / "summary.json"));
}

TEST(Outputs, WithoutFfmpegTheFramesAreKept) {
  const TemporaryDirectory directory;
  const Outcome outcome = run_demo(
      {"run", "flight", "--mesh", "box", "--cells", "2", "--duration", "0.1", "--out", directory.path().string()},
      "PATH=/nonexistent LP_NUM_THREADS=1");
  ASSERT_EQ(outcome.status, 0) << outcome.errors;
  EXPECT_NE(outcome.errors.find("ffmpeg"), std::string::npos) << outcome.errors;
  int frames = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(directory.path()))
    frames += entry.path().filename().string().starts_with("frame_");
  EXPECT_EQ(frames, 4);  // 0, 1/30, 2/30 and 3/30 s
}

}  // namespace
}  // namespace penalty::test
