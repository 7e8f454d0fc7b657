uniform sampler2D u_faces; uniform vec3 u_eye;
in vec2 v_uv; in vec3 v_pos; flat in vec3 v_normal; flat in vec3 v_glow; flat in vec4 v_box; flat in uint v_id;
out uvec2 label;
void main() {
  if (texture(u_faces, v_uv).a < 0.5) discard;
  label = uvec2(gl_FrontFacing ? v_id : 0u, uint(distance(v_pos, u_eye) * 100.0));
}
