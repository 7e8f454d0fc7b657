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
