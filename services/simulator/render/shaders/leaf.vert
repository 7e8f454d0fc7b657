#include "common.glsl"
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
