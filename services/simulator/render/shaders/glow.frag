uniform float u_beta;
in vec2 v_spot; flat in vec3 v_colour; flat in float v_dist;
out vec4 colour;
void main() {
  float r2 = dot(v_spot, v_spot);
  if (r2 > 1.0) discard;
  float fall = 1.0 - r2;
  colour = vec4(v_colour * (fall * fall * fall) * exp(-u_beta * v_dist * 0.7), 0.0);
}
