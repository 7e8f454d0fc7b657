#include "common.glsl"
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
