#include "render/shaders.h"

namespace penalty::render {
namespace {

const char* const version = "#version 330\n";

// Rigid bodies: one mesh a shape, placed by its instance. Surfaces arrive in place. The ground is two triangles.
const char* const placement = R"(
#if RIGID
layout(location=0) in vec3 core; layout(location=1) in vec3 direction; layout(location=2) in vec3 flat_normal;
layout(location=3) in vec4 row0; layout(location=4) in vec4 row1; layout(location=5) in vec4 row2;
layout(location=6) in vec4 size; layout(location=7) in vec4 tint;
vec3 local_point() { return core * size.xyz + direction * size.w; }
vec3 placed() { vec4 q = vec4(local_point(), 1); return vec3(dot(row0, q), dot(row1, q), dot(row2, q)); }
#elif GROUND
uniform float ground_height, ground_radius;
vec3 placed() {
  vec2 corner = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2. - 1.;
  return vec3(corner.x * ground_radius, ground_height, corner.y * ground_radius);
}
#else
layout(location=0) in vec3 point; layout(location=1) in vec3 flat_normal; layout(location=2) in float place;
vec3 placed() { return point; }
#endif
uniform mat4 view_projection;
)";

const char* const scene_vertex_main = R"(
out vec3 position, normal, local, corner; out float value; out vec4 color;
void main() {
  position = placed();
  gl_Position = view_projection * vec4(position, 1);
  local = vec3(0); value = 0.; color = vec4(0); corner = vec3(0);
#if RIGID
  normal = vec3(dot(row0.xyz, flat_normal), dot(row1.xyz, flat_normal), dot(row2.xyz, flat_normal));
  local = local_point(); color = tint;
#elif GROUND
  normal = vec3(0, 1, 0);
#else
  normal = flat_normal; value = place;
  int k = gl_VertexID % 3; corner = vec3(k == 0, k == 1, k == 2);   // barycentrics for the wires
#endif
}
)";

const char* const depth_vertex_main = "void main() { gl_Position = view_projection * vec4(placed(), 1); }\n";

// The backdrop depends on the height in the picture only, so that the ground can fade into exactly this colour.
const char* const backdrop = R"(
vec3 backdrop(float height) {
  const vec3 fog = vec3(.80, .83, .87);
  return mix(fog * 1.06, fog * vec3(.70, .78, .90), smoothstep(.25, 1.15, height));
}
)";

const char* const lighting = R"(
in vec3 position, normal, local, corner; in float value; in vec4 color;
out vec4 result;
uniform vec3 eye, sun_direction, sky_direction, plain_color;
uniform mat4 sun_matrix, sky_matrix;
uniform sampler2DShadow sun_map, sky_map;
uniform sampler2D sun_depth, color_map;
uniform vec2 noise, resolution, grid_offset;
uniform float floor_height, bounce, fade_radius, grid_scale, grid_major;

const vec3 sun_color = vec3(1., .96, .90) * .78;
const float ambient = .50;

float dither(vec2 p) { return fract(52.9829189 * fract(dot(p, vec2(.06711056, .00583715)))); }
vec2 spiral(int i, float n, float turn) {
  float r = sqrt((float(i) + .5) / n), t = float(i) * 2.39996323 + turn;
  return r * vec2(cos(t), sin(t));
}

// Lights see the unit sphere of the scene. A receiver behind it is still shaded by what is in it: only x and y decide.
vec3 in_map(mat4 light, vec3 p) { vec3 q = (light * vec4(p, 1)).xyz * .5 + .5; return vec3(q.xy, min(q.z, 1.)); }
bool outside(vec3 q) { return any(lessThan(q.xy, vec2(0))) || any(greaterThan(q.xy, vec2(1))); }

float sun_visibility(vec3 p, vec3 n) {
  vec3 q = in_map(sun_matrix, p + n * SUN_OFFSET);
  if (outside(q)) return 1.;
#if TAPS == 1
  return texture(sun_map, q);
#else
  float turn = 6.2831853 * dither(gl_FragCoord.xy + noise * 64.), radius = .012;
#if SINGLE_PASS
  // Percentage-closer soft shadows: the mean distance to what blocks the sun sets the width of the penumbra.
  float depth = 0., blockers = 0.;
  for (int i = 0; i < 6; i++) {
    float d = texture(sun_depth, q.xy + spiral(i, 6., turn) * .034).r;
    if (d < q.z - .004) { depth += d; blockers += 1.; }
  }
  if (blockers < .5) return 1.;
  radius = clamp((q.z - depth / blockers) * .16, .0015, .034);
#endif
  float sum = 0.;
  for (int i = 0; i < TAPS; i++) sum += texture(sun_map, vec3(q.xy + spiral(i, float(TAPS), turn) * radius, q.z));
  return sum / float(TAPS);
#endif
}

float sky_visibility(vec3 p, vec3 n) {
  vec3 q = in_map(sky_matrix, p + n * SKY_OFFSET);
  if (outside(q)) return 1.;
#if TAPS == 1
  return texture(sky_map, q);
#else
  float turn = 6.2831853 * dither(gl_FragCoord.yx + noise * 97.), sum = 0.;
  for (int i = 0; i < SKY_TAPS; i++)
    sum += texture(sky_map, vec3(q.xy + spiral(i, float(SKY_TAPS), turn) * SKY_RADIUS, q.z - .006));
  return sum / float(SKY_TAPS);
#endif
}

vec3 sky(vec3 d) { return mix(vec3(.93, .92, .90), vec3(.78, .87, 1.), smoothstep(-.1, .9, d.y)); }

float ggx(vec3 n, vec3 v, vec3 l, float a) {
  vec3 h = normalize(v + l);
  float nh = max(dot(n, h), 0.), nv = max(dot(n, v), 1e-3), nl = max(dot(n, l), 0.);
  float a2 = a * a, d = nh * nh * (a2 - 1.) + 1., k = a * .5;
  return a2 / (3.14159 * d * d) * .25 / ((nl * (1. - k) + k) * (nv * (1. - k) + k));
}

// A grid line at every whole x, `width` wide, never thinner than a pixel but then fainter; gone before it aliases.
float grid_line(float x, float width) {
  float f = fwidth(x), t = abs(fract(x - .5) - .5), d = max(width, f);
  return clamp(width / d, 0., 1.) * (1. - smoothstep(d * .5 - f * .5, d * .5 + f * .5, t)) * (1. - smoothstep(.25, .6, f));
}
)";

const char* const scene_fragment_main = R"(
void main() {
  vec3 n = normalize(normal), v = normalize(eye - position), albedo;
  float roughness, f0 = .04;
#if SURFACE
  if (!gl_FrontFacing) n = -n;   // cloth, and bodies turned inside out
  roughness = .42;
#if COLOR_MAPPED
  albedo = texture(color_map, vec2(clamp(value, 0., 1.) * (255. / 256.) + .5 / 256., .5)).rgb;
#else
  albedo = plain_color;
#endif
#if WIRE
  vec3 f = max(fwidth(corner) * .85, 1e-5), a = smoothstep(f * .35, f * 1.25, corner);
  float edge = 1. - min(a.x, min(a.y, a.z)), density = max(f.x, max(f.y, f.z));
  edge *= 1. - smoothstep(.16, .36, density);
  albedo = mix(albedo, albedo * .32, edge * .55);
#endif
#elif GROUND
  vec2 g = position.xz * grid_scale + grid_offset, m = g / grid_major;
  float fine = max(grid_line(g.x, .012), grid_line(g.y, .012)), bold = max(grid_line(m.x, .008), grid_line(m.y, .008));
  albedo = vec3(.62, .63, .645);
  albedo = mix(albedo, albedo * .72, max(fine * .45, bold * .9));
  roughness = .55; f0 = .02;
#else
  // Octants of the body in two tones, their borders smoothed over a pixel.
  vec3 across = local / (fwidth(local) + 1e-6), s = clamp(across + .5, 0., 1.) * 2. - 1.;
  albedo = mix(color.rgb, color.rgb * .55 + .02, color.a * (s.x * s.y * s.z * .5 + .5));
  roughness = .35;
#endif

  float nl = dot(n, sun_direction), lit = nl > 0. ? nl * sun_visibility(position, n) : 0.;
  vec3 light = albedo * sun_color * lit;
  float above = position.y - floor_height;
#if SINGLE_PASS
  float open = sky_visibility(position, n);
#if GROUND
  light += albedo * mix(vec3(.42, .40, .38), sky(n), n.y * .5 + .5) * ambient * mix(.42, 1., open);
#else
  float exposed = mix(.45, 1., smoothstep(-.2, .6, above + n.y * .3)) * mix(1., mix(.62, 1., open), max(n.y, 0.));
  light += albedo * mix(vec3(.42, .40, .38), sky(n), n.y * .5 + .5) * ambient * exposed;
#endif
#else
  float facing = dot(n, sky_direction);
  if (facing > 0.) light += albedo * sky(sky_direction) * ambient * 2. * facing * sky_visibility(position, n);
  // Light that the ground throws back, fainter near it, where bodies shade it; without one, the backdrop's.
  light += albedo * vec3(.30, .29, .28) * bounce * ambient * max(0., .5 - .5 * n.y) * smoothstep(-.1, .75, above);
#endif
  float fresnel = f0 + (1. - f0) * pow(1. - max(dot(n, v), 0.), 5.);
  light += sun_color * ggx(n, v, sun_direction, roughness * roughness) * fresnel / f0 * .036 * lit;
#if GROUND
  float r = length(position.xz) / fade_radius;
  light = mix(light, backdrop(gl_FragCoord.y / resolution.y), smoothstep(.30, 1., r));
#else
  vec3 r = reflect(-v, n);
  light += fresnel * mix(vec3(.25, .24, .23), sky(r), smoothstep(-.15, .25, r.y)) * ambient * (1. - roughness) * .9;
#endif
  if (any(isnan(light)) || any(isinf(light))) light = vec3(0);   // one bad sample must not eat the whole pixel
  result = vec4(min(light, vec3(16)), 1);
}
)";

std::string define(const char* name, int value) {
  return std::string("#define ") + name + " " + std::to_string(value) + "\n";
}

std::string kind_defines(Kind kind) {
  return define("RIGID", kind == Kind::rigid) + define("SURFACE", kind == Kind::surface) +
         define("GROUND", kind == Kind::ground);
}

}  // namespace

std::string scene_vertex_shader(Kind kind) { return version + kind_defines(kind) + placement + scene_vertex_main; }

std::string scene_fragment_shader(const SceneVariant& variant) {
  std::string defines = kind_defines(variant.kind) + define("COLOR_MAPPED", variant.color_mapped) +
                        define("WIRE", variant.wire) + define("TAPS", variant.taps) +
                        define("SINGLE_PASS", variant.single_pass);
  // Points are looked up a little off the surface, against self-shadowing: further where the filter is wider.
  defines += variant.taps == 1 ? "#define SUN_OFFSET .004\n#define SKY_OFFSET .0065\n"
                               : "#define SUN_OFFSET .006\n#define SKY_OFFSET .010\n";
  defines += variant.single_pass ? "#define SKY_TAPS 6\n#define SKY_RADIUS .09\n"
                                 : "#define SKY_TAPS 4\n#define SKY_RADIUS .036\n";
  return version + defines + backdrop + lighting + scene_fragment_main;
}

std::string depth_vertex_shader(Kind kind) { return version + kind_defines(kind) + placement + depth_vertex_main; }

std::string depth_fragment_shader() { return std::string(version) + "void main() {}\n"; }

std::string full_screen_vertex_shader() {
  return std::string(version) + R"(
out vec2 uv;
void main() { uv = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2); gl_Position = vec4(uv * 2. - 1., 0, 1); }
)";
}

std::string backdrop_fragment_shader() {
  return std::string(version) + backdrop + R"(
in vec2 uv; out vec4 result;
void main() { result = vec4(backdrop(uv.y), 1); }
)";
}

std::string accumulate_fragment_shader() {
  return std::string(version) + R"(
in vec2 uv; out vec4 result;
uniform sampler2D pass_image; uniform float weight;
void main() { result = vec4(texture(pass_image, uv).rgb * weight, 1); }
)";
}

std::string develop_fragment_shader() {
  return std::string(version) + R"(
in vec2 uv; out vec4 result;
uniform sampler2D light;
void main() {
  vec3 c = texture(light, uv).rgb * 1.07;
  vec2 d = uv - .5;
  c *= 1. - .35 * dot(d, d);
  // The shoulder acts on luminance alone: per channel it would bleach the colour map's hues.
  float l = dot(c, vec3(.2126, .7152, .0722)), bent = l < .7 ? l : .7 + .3 * (1. - exp(-(l - .7) / .3));
  c = clamp(c * bent / max(l, 1e-4), 0., 1.);
  c = mix(12.92 * c, 1.055 * pow(c, vec3(1. / 2.4)) - .055, step(.0031308, c));
  float dither = fract(52.9829189 * fract(dot(gl_FragCoord.xy, vec2(.06711056, .00583715)))) - .5;
  result = vec4(c + dither / 255., 1);
}
)";
}

std::string overlay_vertex_shader() {
  return std::string(version) + R"(
layout(location=0) in vec2 point; layout(location=1) in vec2 texture_point;
layout(location=2) in vec4 tint; layout(location=3) in float kind;
uniform vec2 resolution;
out vec2 uv; out vec4 color; flat out int brush;
void main() {
  uv = texture_point; color = tint; brush = int(kind + .5);
  gl_Position = vec4(point.x / resolution.x * 2. - 1., 1. - point.y / resolution.y * 2., 0, 1);
}
)";
}

std::string overlay_fragment_shader() {
  return std::string(version) + R"(
in vec2 uv; in vec4 color; flat in int brush; out vec4 result;
uniform sampler2D glyphs;
void main() {
  result = color;
  if (brush == 1) result.a *= texture(glyphs, uv).r;
  else if (brush == 2) result.a *= clamp(uv.x - abs(uv.y) + .5, 0., 1.);   // a line: half width, distance to its middle
}
)";
}

}  // namespace penalty::render
