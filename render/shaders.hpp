// Sources of the GL programs. Private to this module's sources.
#pragma once

namespace parhelion::render::shaders {

/// Shapes by instance: point = core * scale + direction * bevel, transformed to the optical frame, then to
/// the view. Image rows grow downwards in the frame buffer, so read-back needs no flip.
inline constexpr const char* kShapeVertex = R"(#version 310 es
layout(location = 0) in vec3 core;
layout(location = 1) in vec3 direction;
layout(location = 2) in vec3 rotation_x;
layout(location = 3) in vec3 rotation_y;
layout(location = 4) in vec3 rotation_z;
layout(location = 5) in vec3 translation;
layout(location = 6) in vec4 scale;          // xyz, bevel
layout(location = 7) in vec4 albedo;         // rgb, roughness
layout(location = 8) in vec2 metal_entity;
uniform mat3 R_view_optical;
uniform vec4 pinhole;                        // clip.x = pinhole.x * x + pinhole.y * z, clip.y = pinhole.z * y + pinhole.w * z
uniform vec4 depth_range;                    // clip.z = x * z + y; z: bias in metres
out vec3 p_optical;
out vec3 normal;
flat out vec4 surface;
flat out vec2 metal_id;
out float view_z;
void main() {
  mat3 R = mat3(rotation_x, rotation_y, rotation_z);
  p_optical = R * (core * scale.xyz + direction * scale.w) + translation;
  normal = R * direction;
  surface = albedo;
  metal_id = metal_entity;
  vec3 p = R_view_optical * p_optical;
  view_z = p.z;
  float biased = p.z > 4.0 * depth_range.z ? p.z * (1.0 - depth_range.z / length(p)) : p.z;
  float clip_z = p.z > 4.0 * depth_range.z ? (depth_range.x + depth_range.y / biased) * p.z
                                           : depth_range.x * p.z + depth_range.y;
  gl_Position = vec4(pinhole.x * p.x + pinhole.y * p.z, pinhole.z * p.y + pinhole.w * p.z, clip_z, p.z);
}
)";

/// Distance along the view's axis in quarters of a millimetre (22 bits) and the entity (10 bits).
inline constexpr const char* kDepthIdFunction = R"(
uint depth_id(float z, float entity) {
  return (uint(clamp(z * 4000.0 + 0.5, 1.0, 4194303.0)) << 10u) | uint(entity + 0.5);
}
)";

/// Hemisphere ambient, one key light, GGX (Walter et al. 2007, equation 33) with Smith-Schlick visibility
/// (Karis 2013) and Schlick's Fresnel, in linear light, written in sRGB.
inline constexpr const char* kLitFunction = R"(
uniform vec3 up;
uniform vec3 to_light;
vec3 srgb(vec3 linear) {  // to 0.3 % of the sRGB curve by roots: a software driver pays dearly for pow
  vec3 r = sqrt(clamp(linear, 0.0, 1.0)), q = sqrt(r);
  return max(0.662002687 * r + 0.684122060 * q - 0.323583601 * sqrt(q) - 0.0225411470 * linear, 0.0);
}
vec3 lit(vec3 albedo, float roughness, float metallic, vec3 n, vec3 v) {
  vec3 h = normalize(to_light + v);
  float nl = max(dot(n, to_light), 0.0), nv = max(dot(n, v), 0.02), nh = max(dot(n, h), 0.0), vh = max(dot(v, h), 0.0);
  float a = roughness * roughness, a2 = a * a;
  float d = nh * nh * (a2 - 1.0) + 1.0;
  float k = 0.125 * (roughness + 1.0) * (roughness + 1.0);
  float visibility = 0.25 / ((nl * (1.0 - k) + k) * (nv * (1.0 - k) + k));
  vec3 f0 = mix(vec3(0.04), albedo, metallic);
  float grazing = 1.0 - vh, g2 = grazing * grazing;
  vec3 fresnel = f0 + (1.0 - f0) * (g2 * g2 * grazing);
  vec3 specular = fresnel * (a2 / (3.14159 * d * d) * visibility);
  float sky = 0.5 + 0.5 * dot(n, up);
  vec3 ambient = mix(vec3(0.20, 0.19, 0.18), vec3(0.52, 0.54, 0.57), sky);
  vec3 diffuse = albedo * (1.0 - metallic);
  return diffuse * (ambient + 0.62 * nl) + f0 * ambient * 0.6 + specular * (1.9 * nl);
}
)";

inline constexpr const char* kShapeFragment = R"(
in vec3 p_optical;
in vec3 normal;
flat in vec4 surface;
flat in vec2 metal_id;
in float view_z;
layout(location = 0) out vec4 colour;
layout(location = 1) out uint identity;
void main() {
  colour = vec4(srgb(lit(surface.rgb, surface.a, metal_id.x, normalize(normal), normalize(-p_optical))), 1.0);
  identity = depth_id(view_z, metal_id.y);
}
)";

inline constexpr const char* kDepthFragment = R"(
in vec3 p_optical;
in vec3 normal;
flat in vec4 surface;
flat in vec2 metal_id;
in float view_z;
layout(location = 1) out uint identity;
void main() { identity = depth_id(view_z, metal_id.y); }
)";

/// The occlusion of the floor's ambient and key light by a body, by the distance to its footprint: a narrow
/// dark contact and a wide soft surround. Black with the darkness as its coverage.
inline constexpr const char* kShadowVertex = R"(#version 310 es
layout(location = 0) in vec3 position;
layout(location = 1) in vec2 local_in;
layout(location = 2) in vec2 half_in;
layout(location = 3) in vec4 shape_in;       // corner, softness, contact, ambient
uniform mat3 R_view_optical;
uniform vec4 pinhole;
uniform vec4 depth_range;
out vec2 local;
flat out vec2 half_extent;
flat out vec4 shape;
void main() {
  local = local_in;
  half_extent = half_in;
  shape = shape_in;
  vec3 p = R_view_optical * position;
  // With a bias it comes nearer: a shadow lies in the very plane of a floor that was drawn before it.
  bool raised = depth_range.z > 0.0 && p.z > 4.0 * depth_range.z;
  float clip_z = raised ? (depth_range.x + depth_range.y / (p.z * (1.0 - depth_range.z / length(p)))) * p.z
                        : depth_range.x * p.z + depth_range.y;
  gl_Position = vec4(pinhole.x * p.x + pinhole.y * p.z, pinhole.z * p.y + pinhole.w * p.z, clip_z, p.z);
}
)";

inline constexpr const char* kShadowFragment = R"(
in vec2 local;
flat in vec2 half_extent;
flat in vec4 shape;
layout(location = 0) out vec4 colour;
void main() {
  vec2 q = abs(local) - half_extent + shape.x;
  float distance = length(max(q, 0.0)) + min(max(q.x, q.y), 0.0) - shape.x;
  float contact = shape.z * (1.0 - smoothstep(-0.01, 0.04, distance));
  float ambient = shape.w * (1.0 - smoothstep(-shape.y, shape.y, distance));
  colour = vec4(0.0, 0.0, 0.0, 1.0 - (1.0 - contact) * (1.0 - ambient));
}
)";

/// Floor to the horizon with a grid of 1 m, and a bright ceiling above: the background of the picture.
inline constexpr const char* kBackdropVertex = R"(#version 310 es
void main() {
  vec2 p = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(p, 0.0, 1.0);
}
)";

inline constexpr const char* kSceneryFunction = R"(
const vec3 haze = vec3(0.56, 0.60, 0.64);
vec3 floor_colour(vec2 p, float distance) {
  vec2 width = clamp(fwidth(p), 0.001, 0.5);
  vec2 cell = abs(fract(p + 0.5) - 0.5);
  vec2 line = 1.0 - smoothstep(0.008 + 0.0 * width, 0.012 + 1.2 * width, cell);
  vec2 tile = floor(p);
  float checker = mod(tile.x + tile.y, 2.0);
  float fade = exp(-distance / 12.0);
  vec3 base = mix(vec3(0.300, 0.268, 0.230), vec3(0.345, 0.312, 0.272), mix(0.5, checker, fade));
  return mix(base, base * 0.62, max(line.x, line.y) * fade);
}
vec3 hazed(vec3 colour, float distance) { return mix(haze, colour, exp(-distance / 45.0)); }
)";

inline constexpr const char* kBackdropFragment = R"(
uniform mat3 R_map_view;
uniform vec4 inverse_pinhole;                // x: 1 / fx, y: cx, z: 1 / fy, w: cy
uniform vec4 camera;                         // map position of the camera, w: floor
layout(location = 0) out vec4 colour;
void main() {
  vec2 pixel = gl_FragCoord.xy - 0.5;
  vec3 ray = normalize(R_map_view * vec3((pixel.x - inverse_pinhole.y) * inverse_pinhole.x,
                                         (pixel.y - inverse_pinhole.w) * inverse_pinhole.z, 1.0));
  float height = camera.z - camera.w;
  float distance = height / max(-ray.z, 1e-4);
  vec3 ground = hazed(floor_colour(camera.xy + ray.xy * distance, distance), distance);
  vec3 above = mix(haze, vec3(0.80, 0.82, 0.84), smoothstep(0.0, 0.5, ray.z));
  float horizon = clamp(-ray.z * height * 60.0, 0.0, 1.0);
  colour = vec4(srgb(mix(above, ground, height > 0.0 ? horizon : 0.0)), 1.0);
}
)";

/// Walls, doors and the rest of the building: darker towards the floor, hazy in the distance, glass
/// transparent.
inline constexpr const char* kSceneryFragment = R"(
uniform mat3 R_map_view;                     // R_map_optical here
uniform vec4 camera;
in vec3 p_optical;
in vec3 normal;
flat in vec4 surface;
flat in vec2 metal_id;                       // x: opacity
in float view_z;
layout(location = 0) out vec4 colour;
void main() {
  vec3 n = normalize(normal);
  vec3 p_map = R_map_view * p_optical + camera.xyz;
  float distance = length(p_optical);
  float height = p_map.z - camera.w;
  vec3 albedo = surface.rgb;
  float upward = dot(n, up);
  if (surface.a > 1.5 && upward > 0.9) albedo = floor_colour(p_map.xy, distance);
  float corner = upward > 0.5 ? 1.0 : 0.70 + 0.30 * smoothstep(0.0, 0.9, height);
  float skirting = upward < 0.5 && height < 0.09 ? 0.72 : 1.0;
  // Opposite walls of a corridor differ a little, as if lit from one end: edges between walls stay visible.
  float side = 0.90 + 0.10 * dot(R_map_view * n, vec3(0.6, 0.8, 0.0));
  vec3 shaded = lit(albedo, 0.85, 0.0, n, normalize(-p_optical)) * (1.15 * corner * skirting * side);
  colour = vec4(srgb(hazed(shaded, distance)), metal_id.x);
}
)";

/// The recorded surface, as bright as it was recorded. In neutral stripes, with less alpha, what no image
/// shows: nothing is invented there.
inline constexpr const char* kSiteVertex = R"(#version 310 es
layout(location = 0) in vec3 position;       // map
layout(location = 1) in vec2 place_in;
layout(location = 2) in float recorded_in;
uniform mat3 R_view_optical;
uniform vec4 pinhole;
uniform vec4 depth_range;
uniform mat3 R_map_view;                     // R_map_optical here
uniform vec4 camera;
out vec2 place;
out vec3 p_map;
flat out float recorded;
void main() {
  place = place_in;
  p_map = position;
  recorded = recorded_in;
  vec3 p = R_view_optical * ((position - camera.xyz) * R_map_view);
  gl_Position = vec4(pinhole.x * p.x + pinhole.y * p.z, pinhole.z * p.y + pinhole.w * p.z,
                     depth_range.x * p.z + depth_range.y, p.z);
}
)";

inline constexpr const char* kUnrecordedFunction = R"(
vec4 unrecorded(float along) { return vec4(vec3(fract(along) < 0.5 ? 0.40 : 0.46), 0.5); }
)";

inline constexpr const char* kSiteFragment = R"(
uniform sampler2D picture;
in vec2 place;
in vec3 p_map;
flat in float recorded;
layout(location = 0) out vec4 colour;
void main() {
  colour = recorded > 0.5 && gl_FrontFacing ? vec4(texture(picture, place).rgb, 1.0)
                                            : unrecorded(5.0 * (p_map.x + p_map.y + p_map.z));
}
)";

inline constexpr const char* kUnrecordedFragment = R"(
uniform mat3 R_map_view;
uniform vec4 inverse_pinhole;
layout(location = 0) out vec4 colour;
void main() {
  vec2 pixel = gl_FragCoord.xy - 0.5;
  vec3 ray = normalize(R_map_view * vec3((pixel.x - inverse_pinhole.y) * inverse_pinhole.x,
                                         (pixel.y - inverse_pinhole.w) * inverse_pinhole.z, 1.0));
  colour = unrecorded(12.0 * (ray.x + ray.y + ray.z));
}
)";

}  // namespace parhelion::render::shaders
