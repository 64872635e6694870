// What goes wrong says what, where, and what to do about it.
#include <gtest/gtest.h>

#include "pixels.h"

namespace penalty::render::test {
namespace {

template <class Error, class Action>
std::string message_of(const Action& action) {
  try {
    action();
  } catch (const Error& error) {
    return error.what();
  }
  ADD_FAILURE() << "did not throw";
  return "";
}

bool has(const std::string& text, const std::string& part) { return text.find(part) != std::string::npos; }

TEST(Errors, NoBackEndNamesThePackages) {
  const BackendLibraries none{.osmesa = {"libNoSuchOsmesa.so"}, .egl = {"libNoSuchEgl.so"}};
  const std::string message = message_of<std::runtime_error>([&] { Renderer({.libraries = none}); });
  for (const char* part : {"libosmesa6", "libegl1", "libgl1-mesa-dri", "libNoSuchOsmesa.so", "libNoSuchEgl.so"})
    EXPECT_TRUE(has(message, part)) << message << " lacks " << part;
  // Asked for by name, the other is no substitute.
  const std::string one = message_of<std::runtime_error>(
      [&] { Renderer({.backend = Backend::osmesa, .libraries = {.osmesa = {"libNoSuchOsmesa.so"}}}); });
  EXPECT_TRUE(has(one, "libNoSuchOsmesa.so")) << one;
  EXPECT_FALSE(has(one, "egl said")) << one;
}

TEST(Errors, AutomaticFallsBackToEgl) {
  RendererOptions options = options_for(Backend::automatic);
  options.libraries.osmesa = {"libNoSuchOsmesa.so"};
  EXPECT_EQ(Renderer(options).backend_name(), "egl");
  options.libraries = {};
  EXPECT_EQ(Renderer(options).backend_name(), osmesa_is_gone() ? "egl" : "osmesa");
}

TEST(Errors, UnknownNamesListTheKnownOnes) {
  EXPECT_TRUE(has(message_of<std::invalid_argument>([] { backend_from_name("vulkan"); }), "osmesa"));
  EXPECT_TRUE(has(message_of<std::invalid_argument>([] { quality_from_name("best"); }), "preview"));
  EXPECT_TRUE(has(message_of<std::invalid_argument>([] { color_map_from_name("jet"); }), "viridis"));
  EXPECT_EQ(backend_from_name("auto"), Backend::automatic);
  EXPECT_EQ(backend_from_name("egl"), Backend::egl);
  EXPECT_EQ(quality_from_name("still"), Quality::still);
  EXPECT_EQ(color_map_from_name("diverging"), ColorMap::diverging);
}

TEST(Errors, MissingFontNamesFileAndPackage) {
  RendererOptions options = options_for(Backend::automatic);
  options.font_directory = "/nowhere";
  const std::string message = message_of<std::runtime_error>([&] { Renderer{options}; });
  EXPECT_TRUE(has(message, "/nowhere/DejaVuSans.ttf")) << message;
  EXPECT_TRUE(has(message, "fonts-dejavu-core")) << message;
}

TEST(Errors, ImpossibleSizesAndSamples) {
  EXPECT_THROW(Renderer({.width = 320, .height = 0}), std::invalid_argument);
  EXPECT_THROW(Renderer({.width = -1, .height = 180}), std::invalid_argument);
  EXPECT_THROW(Renderer({.width = 100000, .height = 180}), std::invalid_argument);
  EXPECT_THROW(Renderer({.samples = 3}), std::invalid_argument) << "would show three separate shadows";
  EXPECT_THROW(Renderer({.samples = -1}), std::invalid_argument);
}

TEST(Errors, BadFramesAreNamedAndLeaveTheRendererUsable) {
  Renderer renderer(options_for(Backend::automatic));
  Frame good;
  good.surfaces = {ball({0, 0, 0}, 1)};
  const Image before = renderer.render(good);

  Frame bad = good;
  bad.surfaces[0].triangles[7] = {0, 1, 5000};
  const std::string index = message_of<std::invalid_argument>([&] { renderer.render(bad); });
  EXPECT_TRUE(has(index, "triangle 7") && has(index, "5000")) << index;

  bad = good;
  bad.surfaces[0].values = Eigen::VectorXd::Zero(3);
  EXPECT_TRUE(has(message_of<std::invalid_argument>([&] { renderer.render(bad); }), "3 values"));

  bad = good;
  bad.bodies = {{.shape = Sphere{0}}};
  EXPECT_THROW(renderer.render(bad), std::invalid_argument);
  bad.bodies = {{.shape = Box{{1, 0, 1}}}};
  EXPECT_THROW(renderer.render(bad), std::invalid_argument);

  bad = good;
  bad.camera.eye = bad.camera.target;
  EXPECT_THROW(renderer.render(bad), std::invalid_argument);

  const Series uneven{.name = "energy", .x = {0, 1}, .y = {0}};
  const std::string series =
      message_of<std::invalid_argument>([&] { renderer.render(good, {.inset = Inset{.series = {uneven}}}); });
  EXPECT_TRUE(has(series, "energy")) << series;

  EXPECT_EQ(before.rgb, renderer.render(good).rgb);
}

}  // namespace
}  // namespace penalty::render::test
