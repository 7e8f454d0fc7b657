uniform mat3 u_rays; uniform float u_low;
in vec2 in_corner;
out vec3 v_ray;
void main() {
  vec2 spot = vec2(in_corner.x, mix(u_low, 1.0, in_corner.y * 0.5 + 0.5));
  v_ray = u_rays * vec3(spot, 1.0);
  gl_Position = vec4(spot, 0.9999, 1.0);
}
