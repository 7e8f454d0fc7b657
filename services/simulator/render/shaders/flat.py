"""GLSL for what lies behind: ground, painted lines, shadows, sky; at fixed depths (see ``shaders``)."""

from __future__ import annotations

from services.simulator.render.shaders.common import COMMON

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
uniform vec3 u_earth; uniform float u_beta; uniform vec2 u_ridge;
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
  if (r.z < 0.04) {  // woods and hills far off
    vec2 flat_ray = r.xy * inversesqrt(max(dot(r.xy, r.xy), 1e-6));
    float ridge = texture(u_surfaces, vec3(flat_ray * 0.23 + u_ridge, 1.0)).b;
    float crowns = texture(u_surfaces, vec3(flat_ray * 2.9 + u_ridge, 1.0)).r;
    float top = 0.003 + 0.045 * max(ridge - 0.35, 0.0) + 0.007 * crowns;
    vec3 wood = mix(u_fog, (u_earth + u_sun * 0.3) * vec3(0.070, 0.105, 0.060) * (0.6 + 0.8 * crowns), exp(-u_beta * 1400.0) * 0.75);
    c = mix(c, wood, smoothstep(top + 0.0015, top - 0.0015, r.z));
  }
  colour = vec4(sqrt(c), 1.0);
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
