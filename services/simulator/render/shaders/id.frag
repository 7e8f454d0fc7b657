uniform sampler2DArray u_surfaces; uniform uint u_id; uniform vec3 u_eye;
in vec3 v_pos; in vec3 v_uv;
out uvec2 label;
void main() {
#ifdef LEAFY
  if (texture(u_surfaces, v_uv).a < 0.42) discard;
#endif
  label = uvec2(u_id, uint(distance(v_pos, u_eye) * 100.0));
}
