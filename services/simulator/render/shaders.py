"""GLSL programs. Colours are squared before lighting and rooted after it (a gamma of 2).

Software rasterising runs every branch of a shader: what night, wet roads and rain need is compiled in only for them
(``NIGHT``, ``WET``, ``RAIN``). Flat ground, its shadows and the sky are drawn after all upright things, at fixed depths
behind them (0.9999 the sky, 0.9996 and nearer by layer the ground, 0.9993 shadows), so that no pixel is shaded twice.

The colour target's alpha holds the ground's shade (1 open, less in shadow); ``POST`` multiplies it in.
"""

from __future__ import annotations

HEADER = "#version 330\n"

COMMON = """
uniform vec3 u_eye; uniform vec3 u_sun_dir; uniform vec3 u_sun; uniform vec3 u_sky; uniform vec3 u_earth;
uniform vec3 u_fog; uniform float u_beta; uniform vec3 u_zenith; uniform vec3 u_horizon;
uniform float u_wet;
#ifdef NIGHT
uniform vec3 u_beam_pos; uniform vec3 u_beam_dir; uniform float u_beam;
uniform vec4 u_street[6]; uniform int u_streets;

float headlight(vec3 p) {
  vec3 d = p - u_beam_pos;
  float x = dot(d.xy, u_beam_dir.xy);
  if (x < 0.3) return 0.0;
  float y = d.x * -u_beam_dir.y + d.y * u_beam_dir.x;
  float t = y / (x + 1.0), rise = (d.z + 0.012 * x) / (x + 2.0);
  float wide = exp(-t * t * 7.0);
  float cut = mix(1.0, 0.26, smoothstep(-0.01, 0.04, rise));
  return u_beam * wide * cut * 60.0 / (60.0 + x * x * 0.11) * smoothstep(0.3, 7.0, x);
}
vec3 street(vec3 p, vec3 n) {
  vec3 sum = vec3(0.0);
  for (int k = 0; k < u_streets; ++k) {
    vec3 d = u_street[k].xyz - p;
    float r2 = dot(d, d);
    float lit = max(dot(n, d) * inversesqrt(r2), 0.0);
    sum += vec3(1.0, 0.80, 0.52) * lit * 26.0 / (30.0 + r2 * (0.25 + r2 * 0.02));
  }
  return sum;
}
#endif
vec3 fogged(vec3 c, float dist) { return mix(u_fog, c, exp(-u_beta * dist)); }
"""

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
  c += base * v_kind.x * 2.2;
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

GROUND_VERTEX = """
uniform mat4 u_clip; uniform float u_pixel; uniform vec2 u_shift;
in vec3 in_pos; in vec3 in_normal; in vec2 in_uv; in vec4 in_rgba; in vec4 in_meta;
out vec3 v_pos; out vec2 v_uv; out vec4 v_rgba; flat out vec3 v_kind; out float v_cover; out vec3 v_normal;
void main() {
  vec3 p = in_pos;
  v_cover = 1.0;
  v_normal = in_normal;
#ifdef LINE
  float depth = max((u_clip * vec4(p, 1.0)).w, 0.5);
  float half_width = max(abs(in_uv.y), 0.55 * depth * u_pixel);
  v_cover = abs(in_uv.y) / half_width;
  p += in_normal * half_width * sign(in_uv.y);
  v_normal = vec3(0.0, 0.0, 1.0);
#endif
  p.xy += u_shift;
  v_pos = p; v_uv = in_uv + u_shift; v_rgba = in_rgba;
  v_kind = vec3(floor(in_meta.x * 255.0 + 0.5), floor(in_meta.y * 255.0 + 0.5), 0.0);
  gl_Position = u_clip * vec4(p, 1.0);
  gl_Position.z = (0.9996 - 1e-5 * floor(in_meta.z * 255.0 + 0.5)) * gl_Position.w;
}
"""

GROUND_FRAGMENT = (
    COMMON
    + """
uniform sampler2DArray u_surfaces;
in vec3 v_pos; in vec2 v_uv; in vec4 v_rgba; flat in vec3 v_kind; in float v_cover; in vec3 v_normal;
out vec4 colour;
void main() {
  vec3 to_eye = u_eye - v_pos;
  float dist = length(to_eye);
  vec4 broad = texture(u_surfaces, vec3(v_pos.xy * 0.011, 1.0));
  float cover = v_cover;
#ifdef LINE
  vec3 base = v_rgba.rgb * (0.80 + 0.22 * broad.g);
  float flake = texture(u_surfaces, vec3(v_pos.xy * 0.35, 1.0)).r;
  cover *= 0.95 - 0.75 * smoothstep(0.66, 0.85, flake + 0.12 * (broad.b - 0.5));
#else
  float scale = v_kind.x == 5.0 ? 0.22 : (v_kind.x == 4.0 ? 0.5 : 0.3);
  vec3 base = texture(u_surfaces, vec3(v_uv * scale, v_kind.x)).rgb * v_rgba.rgb * (0.86 + 0.28 * broad.r);
  if (v_kind.x == 5.0) base *= mix(vec3(1.0), vec3(1.12, 1.03, 0.8), broad.b);
  if (v_kind.x == 2.0) {
    base *= mix(0.86, 1.12, smoothstep(0.42, 0.58, broad.g));
    float patchy = smoothstep(0.66, 0.675, broad.b);
    base *= 1.0 - 0.22 * patchy;
    if (v_kind.y == 2.0) {
      float track = abs(abs(v_rgba.a - 0.5) - 0.24);
      base *= 1.0 - 0.14 * exp(-track * track * 240.0) - 0.10 * exp(-pow((v_rgba.a - 0.5) * 9.0, 2.0));
    }
  }
#endif
  base *= base;
  float hard = v_kind.x == 5.0 ? 0.35 : 1.0;
#ifdef WET
  base *= 1.0 - 0.62 * u_wet * hard;
#endif
  vec3 n = vec3(v_normal);
  vec3 light = mix(u_earth, u_sky, n.z * 0.5 + 0.5) + u_sun * max(dot(n, u_sun_dir), 0.0);
#ifdef NIGHT
  {
    float beam = headlight(v_pos);
#ifdef LINE
    beam *= 1.9;
#endif
#ifdef WET
    beam *= 1.0 - 0.45 * u_wet * hard;
#endif
    light += vec3(1.0, 0.97, 0.9) * beam + street(v_pos, n);
  }
#endif
  vec3 c = base * light;
#ifdef WET
  if (hard > 0.5) {
    float f = 1.0 - to_eye.z / dist;
    float f2 = f * f;
    float puddle = smoothstep(0.60 - 0.14 * u_wet, 0.74, broad.a * 0.6 + broad.b * 0.4);
    float amount = u_wet * (0.02 + (0.30 + 0.5 * puddle) * f2 * f2 * f2);
    vec3 sky = mix(u_horizon, u_zenith, clamp(1.2 - f, 0.0, 1.0));
    c = mix(c, sky, amount * (0.85 + 0.3 * broad.r));
    float rx = dot(reflect(-to_eye / dist, vec3(0.0, 0.0, 1.0)), u_sun_dir);
    rx = max(rx, 0.0); rx *= rx; rx *= rx; rx *= rx; rx *= rx;
    c += u_sun * rx * u_wet * 0.25;
  }
#endif
  colour = vec4(sqrt(fogged(c, dist)), cover);
}
"""
)

SKY_VERTEX = """
uniform mat3 u_rays; uniform float u_low;
in vec2 in_corner;
out vec3 v_ray;
void main() {
  vec2 spot = vec2(in_corner.x, mix(u_low, 1.0, in_corner.y * 0.5 + 0.5));
  v_ray = u_rays * vec3(spot, 1.0);
  gl_Position = vec4(spot, 0.9999, 1.0);
}
"""

SKY_FRAGMENT = """
uniform sampler2DArray u_surfaces;
uniform vec3 u_zenith; uniform vec3 u_horizon; uniform vec3 u_fog; uniform vec3 u_sun; uniform vec3 u_sun_dir;
uniform float u_haze; uniform float u_cloud; uniform vec2 u_drift; uniform float u_night;
in vec3 v_ray; out vec4 colour;
void main() {
  vec3 r = normalize(v_ray);
  float up = max(r.z, 0.0);
  vec3 c = mix(u_horizon, u_zenith, 1.0 - exp(-up * 4.5));
  if (r.z > 0.015) {
    vec2 p = r.xy / (r.z + 0.12);
    vec4 a = texture(u_surfaces, vec3(p * 0.10 + u_drift, 1.0)), b = texture(u_surfaces, vec3(p * 0.37 - u_drift, 1.0));
    float d = a.b * 0.65 + b.r * 0.35;
    float cover = smoothstep(0.74 - 0.46 * u_cloud, 0.92 - 0.36 * u_cloud, d) * smoothstep(0.0, 0.14, r.z);
    vec3 lit = mix(u_horizon * 1.12, vec3(dot(u_horizon, vec3(0.33))) * (1.18 - 0.55 * d * u_cloud), 0.7);
    c = mix(c, lit, cover * 0.85);
  }
  float glow = max(dot(r, u_sun_dir), 0.0);
  float g2 = glow * glow; g2 *= g2; float g8 = g2 * g2; float g64 = g8 * g8; g64 *= g64; g64 *= g64;
  c += u_sun * (0.10 * g8 + 0.5 * g64) * (1.0 - 0.8 * u_cloud);
  c = mix(c, u_fog, u_haze * exp(-up * 6.0) + max(u_haze - 0.6, 0.0) * 2.0 * (1.0 - up));
  colour = vec4(sqrt(c), 1.0);
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

GLOW_VERTEX = """
uniform mat4 u_clip; uniform vec2 u_aspect; uniform vec3 u_eye;
in vec2 in_corner; in vec3 in_centre; in vec3 in_size; in vec3 in_colour;
out vec2 v_spot; flat out vec3 v_colour; flat out float v_dist;
void main() {
  v_dist = distance(u_eye, in_centre);
  vec4 p = u_clip * vec4(in_centre, 1.0);
  p.z -= 0.0006 * p.w;
  vec2 size = vec2(in_size.x, in_size.y) * u_aspect;
  size = max(size, p.w * in_size.z * u_aspect.y * vec2(u_aspect.x / u_aspect.y, 1.0));
  p.xy += in_corner * size;
  v_spot = in_corner; v_colour = in_colour;
  gl_Position = p;
}
"""

GLOW_FRAGMENT = """
uniform float u_beta;
in vec2 v_spot; flat in vec3 v_colour; flat in float v_dist;
out vec4 colour;
void main() {
  float r2 = dot(v_spot, v_spot);
  if (r2 > 1.0) discard;
  float fall = 1.0 - r2;
  colour = vec4(v_colour * (fall * fall * fall) * exp(-u_beta * v_dist * 0.7), 0.0);
}
"""

SHADE_VERTEX = """
uniform mat4 u_clip; uniform mat4 u_model; uniform vec3 u_sun_dir; uniform vec3 u_eye; uniform float u_beta; uniform float u_shade;
in vec3 in_pos;
out float v_shade;
void main() {
  vec4 world = u_model * vec4(in_pos, 1.0);
  world.xy -= u_sun_dir.xy / max(u_sun_dir.z, 0.12) * world.z;
  world.z = 0.0;
  v_shade = 1.0 - u_shade * exp(-u_beta * distance(world.xyz, u_eye));
  gl_Position = u_clip * world;
  gl_Position.z = 0.9993 * gl_Position.w;
}
"""

SHADE_FRAGMENT = """
in float v_shade;
out vec4 colour;
void main() { colour = vec4(1.0, 1.0, 1.0, v_shade); }
"""

BLOB_VERTEX = """
uniform mat4 u_clip; uniform vec3 u_eye; uniform float u_beta;
in vec2 in_corner; in vec4 in_place; in vec4 in_size;
out vec2 v_spot; flat out vec3 v_look;
void main() {
  float c = cos(in_place.w), s = sin(in_place.w);
  vec2 q = in_corner * in_size.xy;
  vec3 world = vec3(c * q.x - s * q.y, s * q.x + c * q.y, 0.0) + in_place.xyz;
  v_spot = in_corner; v_look = vec3(in_size.z * exp(-u_beta * distance(world, u_eye)), in_size.w, in_size.x / in_size.y);
  gl_Position = u_clip * vec4(world, 1.0);
  gl_Position.z = 0.9993 * gl_Position.w;
}
"""

BLOB_FRAGMENT = """
in vec2 v_spot; flat in vec3 v_look;
out vec4 colour;
void main() {
  vec2 a = abs(v_spot);
  float box = max(smoothstep(v_look.y, 1.0, a.x), smoothstep(v_look.y, 1.0, a.y));
  float round_ = smoothstep(v_look.y, 1.0, length(v_spot));
  float edge = v_look.y > 0.3 ? max(box, round_ * 0.0) : round_;
  colour = vec4(1.0, 1.0, 1.0, 1.0 - v_look.x * (1.0 - edge));
}
"""

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

POST_VERTEX = """
in vec2 in_corner; out vec2 v_uv;
void main() { v_uv = vec2(in_corner.x, -in_corner.y) * 0.5 + 0.5; gl_Position = vec4(in_corner, 0.0, 1.0); }
"""

POST_FRAGMENT = """
uniform sampler2D u_image; uniform sampler2D u_grain; uniform sampler2D u_streaks; uniform sampler2D u_drops;
uniform vec2 u_texel; uniform ivec2 u_shift; uniform vec3 u_rain; uniform float u_noise; uniform float u_drop; uniform vec2 u_drop_shift;
uniform vec3 u_streak_colour; uniform float u_gain;
in vec2 v_uv; out vec4 colour;
vec3 tap(vec2 uv) { vec4 t = texture(u_image, uv); return t.rgb * t.a; }
void main() {
  vec2 uv = v_uv;
#ifdef RAIN
  vec3 lens = texture(u_drops, v_uv + u_drop_shift).rgb;
  uv = clamp(uv + (lens.xy - 0.49804) * 0.11 * u_drop, 0.0, 1.0);
#endif
  vec3 c = 0.5 * (tap(uv + u_texel * vec2(0.36, 0.30)) + tap(uv - u_texel * vec2(0.36, 0.30)));
#ifdef RAIN
  vec2 falling = texture(u_streaks, v_uv * vec2(1.3, 0.9) + u_rain.yz).rg;
  c = mix(c, u_streak_colour, min(u_rain.x * (falling.r * 0.62 + falling.g * 0.5), 0.7));
  c *= 1.0 + lens.z * 0.12 * u_drop;
#endif
  vec2 q = v_uv - 0.5;
  c *= u_gain * (1.03 - 0.42 * dot(q, q));
  vec3 grain = texelFetch(u_grain, (ivec2(gl_FragCoord.xy) + u_shift) & 255, 0).rgb - 0.5;
  c += (grain.g + 0.35 * grain) * u_noise * (1.15 - 0.6 * c.g);
  colour = vec4(c, 1.0);
}
"""


def program(source: str, *defines: str) -> str:
    """A complete shader: version, defines, source."""
    return HEADER + "".join(f"#define {name}\n" for name in defines) + source
