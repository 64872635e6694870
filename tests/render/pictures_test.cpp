// Pictures are checked by what is measurable in them: where things are, how large, which is darker. No pixel is
// compared with a stored one: drivers may round as they like.
#include <gtest/gtest.h>

#include "pixels.h"

namespace penalty::render::test {
namespace {

class Pictures : public testing::TestWithParam<Backend> {
 protected:
  void SetUp() override {
    if (GetParam() == Backend::osmesa && osmesa_is_gone()) GTEST_SKIP() << "this Mesa has no OSMesa any more";
  }
};
INSTANTIATE_TEST_SUITE_P(BackEnds, Pictures, testing::Values(Backend::osmesa, Backend::egl),
                         [](const auto& c) { return c.param == Backend::osmesa ? "osmesa" : "egl"; });

/// A red ball of radius 1 at the origin, before a fixed camera.
Frame red_ball(double scale = 1, const Eigen::Vector3d& center = {0, 0, 0}) {
  Frame frame;
  frame.surfaces.push_back(ball(center, scale));
  frame.surfaces[0].color = {0.8f, 0.1f, 0.1f};
  frame.surfaces[0].wire = false;
  frame.camera = {.eye = center + scale * Eigen::Vector3d(1, 1.5, 5),
                  .target = center,
                  .scene_center = center,
                  .scene_radius = 1.1 * scale};
  return frame;
}

/// Area in pixels of a ball of radius r whose centre is straight ahead at distance d: a disc, since the silhouette
/// lies on a cone about the axis.
double disc_area(const Frame& frame, double radius) {
  const double d = (frame.camera.eye - frame.camera.target).norm();
  const double tangent = radius / std::sqrt(d * d - radius * radius);
  const double pixels = 0.5 * height * tangent / std::tan(frame.camera.field_of_view * std::numbers::pi / 360);
  return std::numbers::pi * pixels * pixels;
}

TEST_P(Pictures, BallCoversItsDiscAtAnyScaleAndPlace) {
  Renderer renderer(options_for(GetParam()));
  EXPECT_EQ(renderer.backend_name(), GetParam() == Backend::osmesa ? "osmesa" : "egl");
  const std::vector<std::pair<double, Eigen::Vector3d>> cases{
      {1, {0, 0, 0}}, {0.05, {0, 0, 0}}, {50, {0, 0, 0}}, {0.05, {1000, 20, -500}}};
  for (const auto& [scale, center] : cases) {
    const Frame frame = red_ball(scale, center);
    const Region seen(renderer.render(frame), renderer.render(empty_like(frame)));
    const double expected = disc_area(frame, scale);
    EXPECT_GT(expected, 3000);
    EXPECT_NEAR(seen.count, expected, 0.03 * expected) << "scale " << scale;
    EXPECT_NEAR(seen.center.x(), 0.5 * width, 1) << "scale " << scale;
    EXPECT_NEAR(seen.center.y(), 0.5 * height, 1) << "scale " << scale;
    EXPECT_GT(seen.mean_color[0], 2 * seen.mean_color[1]) << "red stays red";
    EXPECT_GT(seen.mean_color[0], 60) << "and is lit";
  }
}

TEST_P(Pictures, RigidShapesAreWhereTheyShouldBe) {
  Renderer renderer(options_for(GetParam()));
  Frame frame = empty_like(red_ball());
  frame.camera.eye = {0, 0, 60};  // from afar: hardly any perspective
  frame.camera.field_of_view = 4;
  const Image empty = renderer.render(frame);
  Transform tilted = at({-1, 0.5, 0});
  tilted.leftCols<3>() = Eigen::AngleAxisd(std::numbers::pi / 2, Eigen::Vector3d::UnitZ()).toRotationMatrix();
  struct Case {
    const char* name;
    Shape shape;
    Transform transform;
    Eigen::Vector2d half;  // extent seen
  };
  const std::vector<Case> cases{{"sphere", Sphere{0.4}, at({1, 0.5, 0}), {0.4, 0.4}},
                                {"box", Box{{0.6, 0.3, 0.2}}, at({-1, -0.5, 0}), {0.6, 0.3}},
                                {"capsule", Capsule{0.2, 0.5}, at({0.5, 0.2, 0}), {0.2, 0.7}},
                                {"lying capsule", Capsule{0.2, 0.5}, tilted, {0.7, 0.2}},
                                {"cylinder", Cylinder{0.3, 0.5}, at({0, 0.1, 0}), {0.3, 0.5}},
                                {"lying cylinder", Cylinder{0.3, 0.5}, tilted, {0.5, 0.3}},
                                {"cone", Cone{0.4}, at({0, 0.1, 0}), {0.4, 0.52}},
                                {"lying cone", Cone{0.4}, tilted, {0.52, 0.4}}};
  for (const Case& c : cases) {
    frame.bodies = {{.shape = c.shape, .transform = c.transform, .color = palette(1)}};
    const Region seen(renderer.render(frame), empty);
    ASSERT_GT(seen.count, 100) << c.name;
    const Eigen::Vector3d center = c.transform.col(3), half(c.half.x(), c.half.y(), 0);
    const Eigen::Vector2d a = projected(frame.camera, center - half), b = projected(frame.camera, center + half);
    EXPECT_NEAR(seen.low.x(), a.x(), 2) << c.name;
    EXPECT_NEAR(seen.high.x(), b.x(), 2) << c.name;
    EXPECT_NEAR(seen.low.y(), b.y(), 2) << c.name;
    EXPECT_NEAR(seen.high.y(), a.y(), 2) << c.name;
  }
}

TEST_P(Pictures, ShadowIsDarkerThanLitGround) {
  for (const int samples : {1, 8}) {
    Renderer renderer(options_for(GetParam(), samples));
    Frame frame = red_ball();
    frame.ground = -1.0;
    const Frame empty = empty_like(frame);
    Frame floating = frame;
    floating.ground.reset();
    Frame nothing = empty;
    nothing.ground.reset();
    // Where the body itself is seen, from a picture without ground.
    const Region body(renderer.render(floating), renderer.render(nothing));
    const Image with = renderer.render(frame), without = renderer.render(empty);
    int shaded = 0;
    double darkest = 1, brightest = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        if (body.mask[static_cast<std::size_t>(y) * width + x]) continue;
        const double ratio = luminance(with.pixel(x, y)) / luminance(without.pixel(x, y));
        shaded += ratio < 0.85;
        darkest = std::min(darkest, ratio);
        brightest = std::max(brightest, ratio);
      }
    EXPECT_GT(shaded, 300) << samples << " samples";
    EXPECT_LT(shaded, 0.3 * width * height) << samples << " samples";
    EXPECT_LT(darkest, 0.72) << samples << " samples";
    EXPECT_LT(brightest, 1.1) << "a body brightens no ground, " << samples << " samples";
  }
}

TEST_P(Pictures, ManySamplesAgreeWithOne) {
  Renderer one(options_for(GetParam())), many(options_for(GetParam(), 64));
  Frame frame = red_ball();
  const Region a(one.render(frame), one.render(empty_like(frame)));
  const Region b(many.render(frame), many.render(empty_like(frame)));
  ASSERT_GT(a.count, 3000);
  EXPECT_NEAR(a.count, b.count, 0.02 * a.count);
  EXPECT_LT((a.mean_color - b.mean_color).cwiseAbs().maxCoeff(), 25);
}

TEST_P(Pictures, ValuesBecomeTheColoursOfTheMap) {
  Renderer renderer(options_for(GetParam()));
  Frame frame = red_ball();
  const Image empty = renderer.render(empty_like(frame));
  SoftSurface& surface = frame.surfaces[0];
  frame.colors = {.map = ColorMap::turbo, .low = 2, .high = 6};
  const auto mean_color = [&](double value) {
    surface.values = Eigen::VectorXd::Constant(surface.vertices.cols(), value);
    const Region seen(renderer.render(frame), empty);
    EXPECT_GT(seen.count, 3000);
    return seen.mean_color;
  };
  const Eigen::Vector3d low = mean_color(2), middle = mean_color(4), high = mean_color(6), beyond = mean_color(60);
  EXPECT_GT(low[2], 1.5 * low[0]) << "blue at the low end";
  EXPECT_GT(middle[1], 1.3 * middle[0]) << "green in the middle";
  EXPECT_GT(middle[1], 1.3 * middle[2]);
  EXPECT_GT(high[0], 2 * high[2]) << "red at the high end";
  EXPECT_EQ(high, beyond) << "clamped";
  frame.colors.map = ColorMap::viridis;
  const Eigen::Vector3d viridis = mean_color(6);
  EXPECT_GT(viridis[0], viridis[2] + 60) << "yellow at viridis' high end";
  EXPECT_GT(viridis[1], viridis[2] + 60);
}

TEST_P(Pictures, WiresDarkenASurfaceALittle) {
  Renderer renderer(options_for(GetParam()));
  Frame frame = red_ball();
  frame.camera.eye *= 0.6;  // cells of several pixels
  const Image empty = renderer.render(empty_like(frame)), plain = renderer.render(frame);
  frame.surfaces[0].wire = true;
  const Image wired = renderer.render(frame);
  const Region body(plain, empty), lines(wired, plain, 4);
  ASSERT_GT(body.count, 3000);
  EXPECT_GT(lines.count, 0.1 * body.count) << "the wires are seen";
  EXPECT_LT(Region(wired, empty).mean_color[0], 0.98 * body.mean_color[0]) << "and darker than the surface";
  for (int y = 0; y < height; ++y)
    for (int x = 0; x < width; ++x) {
      if (body.mask[static_cast<std::size_t>(y) * width + x]) continue;
      ASSERT_LE(std::abs(luminance(wired.pixel(x, y)) - luminance(plain.pixel(x, y))), 8) << "nowhere else";
    }
}

TEST_P(Pictures, TwoTonesShowSpin) {
  Renderer renderer(options_for(GetParam()));
  Frame frame = empty_like(red_ball());
  Transform turned = at({0, 0, 0});
  turned.leftCols<3>() = Eigen::AngleAxisd(std::numbers::pi / 4, Eigen::Vector3d::UnitY()).toRotationMatrix();
  for (const bool two_tone : {true, false}) {
    frame.bodies = {{.shape = Sphere{1}, .two_tone = two_tone}};
    const Image before = renderer.render(frame);
    frame.bodies[0].transform = turned;
    const Region changed(renderer.render(frame), before);
    if (two_tone) {
      EXPECT_GT(changed.count, 1500);
    } else {
      EXPECT_LT(changed.count, 60);
    }
  }
}

TEST_P(Pictures, OverlayShowsBarTitleInsetAndMarkers) {
  Renderer renderer(options_for(GetParam()));
  Frame frame = empty_like(red_ball());
  frame.colors = {.map = ColorMap::turbo, .low = 0, .high = 10};
  const Image empty = renderer.render(frame);
  const auto near_color = [](const Image& image, const Color& color) {
    int count = 0;
    for (int y = 0; y < height; ++y)
      for (int x = 0; x < width; ++x) {
        const auto p = image.pixel(x, y);
        double worst = 0;
        for (int i = 0; i < 3; ++i) worst = std::max(worst, std::abs(p[i] - 255.0 * color[i]));
        count += worst < 10;
      }
    return count;
  };
  // The bar runs through the whole map, at the right edge, and only there.
  const Image bar = renderer.render(frame, {.color_bar = ColorBar{"density", 1}});
  const Region bar_region(bar, empty);
  EXPECT_GT(bar_region.low.x(), 0.6 * width);
  EXPECT_GT(bar_region.count, 300);
  for (const double place : {0.02, 0.25, 0.5, 0.75, 0.98}) {
    EXPECT_GE(near_color(bar, map_color(ColorMap::turbo, place)), 5) << "at " << place;
    EXPECT_EQ(near_color(empty, map_color(ColorMap::turbo, place)), 0) << "at " << place;
  }
  const Region title(renderer.render(frame, {.title = "Title", .subtitle = {"one", "two"}}), empty);
  EXPECT_GT(title.count, 60);
  EXPECT_LT(title.high.y(), 0.2 * height);
  EXPECT_LT(title.high.x(), 0.5 * width);

  const Series red{"elastic", {1, 0, 0}, {0, 1, 2}, {0, 3, 1}};
  const Image inset = renderer.render(frame, {.inset = Inset{.title = "energy [J]", .series = {red}, .x_high = 2}});
  const Region inset_region(inset, empty, 3);
  EXPECT_GT(inset_region.low.y(), 0.5 * height);
  EXPECT_LT(inset_region.high.x(), 0.5 * width);
  EXPECT_GT(near_color(inset, {1, 0, 0}), 5) << "the curve";
  EXPECT_EQ(near_color(empty, {1, 0, 0}), 0);

  frame.markers = {{.position = {0.5, 0.25, 0}, .color = {0.9f, 0.1f, 0.9f}, .radius = 0.1}};
  const Region marker(renderer.render(frame), empty);
  EXPECT_GT(marker.count, 30);
  EXPECT_LT((marker.center - projected(frame.camera, {0.5, 0.25, 0})).norm(), 1.5);
}

TEST_P(Pictures, GroundFadesIntoTheBackdrop) {
  Renderer renderer(options_for(GetParam()));
  Frame frame = empty_like(red_ball());
  const Image sky = renderer.render(frame);
  frame.ground = -1.0;
  const Image ground = renderer.render(frame);
  double top = 0, bottom = 0;
  for (int x = 0; x < width; ++x) {
    top = std::max(top, std::abs(luminance(sky.pixel(x, 2)) - luminance(ground.pixel(x, 2))));
    bottom = std::max(bottom, std::abs(luminance(sky.pixel(x, height - 3)) - luminance(ground.pixel(x, height - 3))));
  }
  EXPECT_LE(top, 1.5) << "no horizon";
  EXPECT_GE(bottom, 8) << "but a ground";
  frame.camera.eye.y() = -3;
  EXPECT_LT(mean_difference(renderer.render(frame), sky), 0.5) << "not drawn from below, where it would hide all";
}

TEST_P(Pictures, NonFiniteVerticesLeaveTheRest) {
  Renderer renderer(options_for(GetParam()));
  Frame frame = red_ball();
  const Image empty = renderer.render(empty_like(frame));
  const int whole = Region(renderer.render(frame), empty).count;
  SoftSurface& surface = frame.surfaces[0];
  surface.values = Eigen::VectorXd::Constant(surface.vertices.cols(), std::nan(""));
  surface.vertices.col(12 * 48).setConstant(std::nan(""));  // on the equator, towards the eye
  const Region seen(renderer.render(frame), empty);
  EXPECT_GT(seen.count, 0.95 * whole);
}

TEST_P(Pictures, SameFrameSamePixels) {
  Renderer renderer(options_for(GetParam(), 8));
  const Frame frame = red_ball();
  const Image first = renderer.render(frame);
  renderer.render(empty_like(frame));
  EXPECT_EQ(first.rgb, renderer.render(frame).rgb);
}

TEST(BothBackEnds, AgreeStatisticallyInOneProcess) {
  if (osmesa_is_gone()) GTEST_SKIP() << "this Mesa has no OSMesa any more";
  // Alternating on purpose: each must find its own context again.
  Renderer osmesa(options_for(Backend::osmesa)), egl(options_for(Backend::egl));
  Frame frame = red_ball();
  frame.ground = -1.0;
  frame.bodies = {{.shape = Sphere{0.4}, .transform = at({1.2, -0.6, 0.5})}};
  const Overlay overlay{.title = "Title", .color_bar = ColorBar{"value", 1}};
  for (int round = 0; round < 2; ++round) {
    const Image a = osmesa.render(frame, overlay), b = egl.render(frame, overlay);
    EXPECT_LT(mean_difference(a, b), 2);
    EXPECT_LT(Region(a, b, 24).count, 0.01 * width * height);
    EXPECT_GT(Region(a, osmesa.render(empty_like(frame))).count, 3000) << "neither is blank";
  }
}

}  // namespace
}  // namespace penalty::render::test
