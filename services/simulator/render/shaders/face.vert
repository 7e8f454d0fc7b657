uniform mat4 u_clip;
in vec2 in_corner; in vec3 in_centre; in vec3 in_right; in vec3 in_up; in vec4 in_box; in vec3 in_glow;
out vec2 v_uv; out vec3 v_pos; flat out vec3 v_normal; flat out vec3 v_glow; flat out vec4 v_box;
#ifdef ID
in float in_id; flat out uint v_id;
#endif
void main() {
  v_pos = in_centre + in_right * in_corner.x + in_up * in_corner.y;
  v_uv = mix(in_box.xy, in_box.zw, in_corner * 0.5 + 0.5);
  v_normal = normalize(cross(in_right, in_up));
  v_glow = in_glow; v_box = in_box;
#ifdef ID
  v_id = uint(in_id + 0.5);
#endif
  gl_Position = u_clip * vec4(v_pos, 1.0);
}
