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
