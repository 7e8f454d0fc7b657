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
