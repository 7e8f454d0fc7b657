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
