#include "common.glsl"
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
