"""GLSL for what stands: solid things, leaves, sign faces, and their ids for labels."""

from __future__ import annotations

from services.simulator.render.shaders.common import COMMON

OBJECT_VERTEX = """
uniform mat4 u_clip; uniform mat4 u_model; uniform float u_lamp[16]; uniform float u_phase;
in vec3 in_pos; in vec3 in_normal; in vec2 in_uv; in vec4 in_rgba; in vec4 in_meta;
#ifdef INSTANCED
in vec4 in_place; in vec4 in_look;
#endif
out vec3 v_pos; out vec3 v_normal; out vec3 v_uv; out vec3 v_rgb; out vec4 v_kind;
vec3 swung(vec3 p, float pivot, float a) {
  float c = cos(a), s = sin(a), z = p.z - pivot;
  return vec3(c * p.x + s * z, p.y, -s * p.x + c * z + pivot);
}
vec3 turned(vec3 n, float a) { return swung(n, 0.0, a); }
void main() {
  vec3 p = in_pos, n = in_normal;
  int layer = int(in_meta.x * 255.0 + 0.5), material = int(in_meta.y * 255.0 + 0.5), joint = int(in_meta.z * 255.0 + 0.5);
  if (joint > 0) {
    float sgn = (joint == 1 || joint == 3 || joint == 6) ? 1.0 : -1.0;
    if (joint == 3 || joint == 4) {
      float bend = 0.75 * max(0.0, cos(6.2831853 * u_phase) * sgn);
      p = swung(p, 0.28, bend); n = turned(n, bend);
    }
    float angle = -sgn * sin(6.2831853 * u_phase) * (joint >= 5 ? 0.42 : 0.48);
    p = swung(p, joint >= 5 ? 0.80 : 0.51, angle); n = turned(n, angle);
  }
#ifdef INSTANCED
  float c = cos(in_place.w), s = sin(in_place.w);
  vec3 q = p * vec3(in_look.x, in_look.x, in_look.y);
  vec4 world = vec4(vec3(c * q.x - s * q.y, s * q.x + c * q.y, q.z) + in_place.xyz, 1.0);
  v_normal = vec3(c * n.x - s * n.y, s * n.x + c * n.y, n.z);
  v_rgb = in_rgba.rgb * vec3(in_look.z, 1.0, in_look.w);
#else
  vec4 world = u_model * vec4(p, 1.0);
  v_normal = mat3(u_model) * n;
  v_rgb = in_rgba.rgb;
#endif
  v_pos = world.xyz;
  v_uv = vec3(in_uv, float(layer));
  float gloss = material == 1 ? 1.0 : (material == 2 ? 0.35 : (material == 15 ? 0.5 : 0.0));
  float special = material == 8 ? 1.0 : (material == 10 ? 2.0 : 0.0);
  v_kind = vec4(u_lamp[material], gloss, special, material == 14 ? 1.0 : 0.0);
  gl_Position = u_clip * world;
}
"""

OBJECT_FRAGMENT = (
    COMMON
    + """
uniform sampler2DArray u_surfaces;
in vec3 v_pos; in vec3 v_normal; in vec3 v_uv; in vec3 v_rgb; in vec4 v_kind;
out vec4 colour;
void main() {
  vec4 texel = texture(u_surfaces, v_uv);
  vec3 base = texel.rgb * v_rgb; base *= base;
  vec3 n = normalize(v_normal), to_eye = u_eye - v_pos;
  float dist = length(to_eye);
  to_eye /= dist;
  float ahead = dot(n, u_sun_dir);
  float sun = max(ahead, 0.0);
  float floor_shade = 0.72 + 0.28 * clamp(v_pos.z * 1.2, 0.0, 1.0);
  vec3 light = mix(u_earth, u_sky, n.z * 0.5 + 0.5) * floor_shade + u_sun * sun;
#ifdef NIGHT
  float beam = headlight(v_pos);
  light += vec3(1.0, 0.97, 0.9) * beam * (0.25 + 0.75 * max(dot(n, to_eye), 0.0)) + street(v_pos, n);
#endif
  vec3 c = base * light;
  if (v_kind.y > 0.0) {
    vec3 r = reflect(-to_eye, n);
    float f = 1.0 - max(dot(n, to_eye), 0.0);
    float f2 = f * f;
    float amount = v_kind.y * (0.10 + 0.80 * f2 * f2 * f);
    vec3 env = r.z > 0.0 ? mix(u_horizon, u_zenith, min(r.z * 1.6, 1.0)) : u_earth * 0.35;
    c = mix(c, env, amount);
    float glint = max(dot(r, u_sun_dir), 0.0);
    glint *= glint; glint *= glint; glint *= glint; glint *= glint; glint *= glint;
    c += u_sun * glint * 0.5 * v_kind.y;
  }
#ifdef NIGHT
  if (v_kind.z > 0.5 && v_kind.z < 1.5) c += base * beam * 3.0;
#endif
  if (v_kind.z > 1.5 && texel.a < 0.5) {
    vec3 r = reflect(-to_eye, n);
    float f = 1.0 - max(dot(n, to_eye), 0.0);
    c = mix(c, mix(u_horizon, u_zenith, clamp(r.z, 0.0, 1.0)), 0.25 + 0.4 * f * f);
#ifdef NIGHT
    float cell = fract(sin(dot(floor(v_uv.xy), vec2(12.9898, 78.233))) * 43758.547);
    if (cell > 0.62) c += vec3(0.75, 0.55, 0.28) * (0.25 + cell * 0.6) * (0.5 + texel.g);
#endif
  }
  c = max(c + base * v_kind.x * 2.2, 0.1 * c);  // an unlit lamp swallows light, never more than nine tenths of it
  colour = vec4(sqrt(fogged(c, dist)), 1.0);
}
"""
)

LEAF_VERTEX = (
    COMMON
    + """
uniform mat4 u_clip;
in vec3 in_pos; in vec3 in_normal; in vec2 in_uv; in vec4 in_rgba; in vec4 in_meta; in vec4 in_place; in vec4 in_look;
out vec3 v_uv; out vec3 v_rgb; out vec4 v_light; out vec3 v_pos;
void main() {
  float c = cos(in_place.w), s = sin(in_place.w);
  vec3 q = in_pos * vec3(in_look.x, in_look.x, in_look.y);
  v_pos = vec3(c * q.x - s * q.y, s * q.x + c * q.y, q.z) + in_place.xyz;
  vec3 n = vec3(c * in_normal.x - s * in_normal.y, s * in_normal.x + c * in_normal.y, in_normal.z);
  float dist = distance(u_eye, v_pos);
  vec3 light = mix(u_earth, u_sky, n.z * 0.5 + 0.5) * (0.72 + 0.28 * clamp(v_pos.z * 1.2, 0.0, 1.0));
  light += u_sun * (0.25 + 0.75 * max(dot(n, u_sun_dir), 0.0));
#ifdef NIGHT
  light += vec3(1.0, 0.97, 0.9) * headlight(v_pos) * (0.25 + 0.75 * max(dot(n, u_eye - v_pos) / dist, 0.0)) + street(v_pos, n);
#endif
  v_rgb = in_rgba.rgb * vec3(in_look.z, 1.0, in_look.w);
  v_uv = vec3(in_uv, floor(in_meta.x * 255.0 + 0.5));
  v_light = vec4(light, exp(-u_beta * dist));
  gl_Position = u_clip * vec4(v_pos, 1.0);
}
"""
)

LEAF_FRAGMENT = """
uniform sampler2DArray u_surfaces; uniform vec3 u_fog;
in vec3 v_uv; in vec3 v_rgb; in vec4 v_light;
out vec4 colour;
void main() {
  vec4 texel = texture(u_surfaces, v_uv);
  if (texel.a < 0.42) discard;
  vec3 base = texel.rgb * v_rgb;
  colour = vec4(sqrt(mix(u_fog, base * base * v_light.rgb, v_light.a)), 1.0);
}
"""

FACE_VERTEX = """
uniform mat4 u_clip;
in vec2 in_corner; in vec3 in_centre; in vec3 in_right; in vec3 in_up; in vec4 in_box; in vec3 in_glow;
out vec2 v_uv; out vec3 v_pos; flat out vec3 v_normal; flat out vec3 v_glow; flat out vec4 v_box;
void main() {
  v_pos = in_centre + in_right * in_corner.x + in_up * in_corner.y;
  v_uv = mix(in_box.xy, in_box.zw, in_corner * 0.5 + 0.5);
  v_normal = normalize(cross(in_right, in_up));
  v_glow = in_glow; v_box = in_box;
  gl_Position = u_clip * vec4(v_pos, 1.0);
}
"""

FACE_FRAGMENT = (
    COMMON
    + """
uniform sampler2D u_faces;
in vec2 v_uv; in vec3 v_pos; flat in vec3 v_normal; flat in vec3 v_glow; flat in vec4 v_box;
out vec4 colour;
void main() {
  vec2 inset = vec2(0.0006);
  vec4 texel = texture(u_faces, clamp(v_uv, v_box.xy + inset, v_box.zw - inset));
  if (texel.a < 0.05) discard;
  vec3 to_eye = u_eye - v_pos;
  float dist = length(to_eye);
  vec3 base = gl_FrontFacing ? texel.rgb / max(texel.a, 0.3) : vec3(0.42);
  base = min(base, vec3(1.0)); base *= base;
  vec3 n = gl_FrontFacing ? v_normal : -v_normal;
  vec3 light = mix(u_earth, u_sky, 0.55 + n.z * 0.5) + u_sun * max(dot(n, u_sun_dir), 0.0);
#ifdef NIGHT
  light += street(v_pos, n) + headlight(v_pos) * 0.6;
#endif
  vec3 c = base * light;
  if (gl_FrontFacing) {
#ifdef NIGHT
    {
      float facing = max(dot(n, to_eye) / dist, 0.0);
      float back = v_glow.y * u_beam * facing * 260.0 / (160.0 + dist * dist * 0.10);
      c += base * min(back, 1.15);
    }
#endif
    if (v_glow.x > 0.0) c = base * v_glow.x + vec3(0.004);
  }
  colour = vec4(sqrt(fogged(c, dist)), texel.a);
}
"""
)

ID_FRAGMENT = """
uniform sampler2DArray u_surfaces; uniform uint u_id; uniform vec3 u_eye;
in vec3 v_pos; in vec3 v_uv;
out uvec2 label;
void main() {
#ifdef LEAFY
  if (texture(u_surfaces, v_uv).a < 0.42) discard;
#endif
  label = uvec2(u_id, uint(distance(v_pos, u_eye) * 100.0));
}
"""

FACE_ID_VERTEX = (
    FACE_VERTEX.replace("in vec3 in_glow;", "in vec3 in_glow; in float in_id;")
    .replace("flat out vec4 v_box;", "flat out vec4 v_box; flat out uint v_id;")
    .replace("v_glow = in_glow;", "v_glow = in_glow; v_id = uint(in_id + 0.5);")
)

FACE_ID_FRAGMENT = """
uniform sampler2D u_faces; uniform vec3 u_eye;
in vec2 v_uv; in vec3 v_pos; flat in vec3 v_normal; flat in vec3 v_glow; flat in vec4 v_box; flat in uint v_id;
out uvec2 label;
void main() {
  if (texture(u_faces, v_uv).a < 0.5) discard;
  label = uvec2(gl_FrontFacing ? v_id : 0u, uint(distance(v_pos, u_eye) * 100.0));
}
"""
