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
