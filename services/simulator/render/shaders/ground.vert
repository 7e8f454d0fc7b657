uniform mat4 u_clip; uniform float u_pixel; uniform vec2 u_shift;
in vec3 in_pos; in vec3 in_normal; in vec2 in_uv; in vec4 in_rgba; in vec4 in_meta;
out vec3 v_pos; out vec2 v_uv; out vec4 v_rgba; flat out vec3 v_kind; out float v_cover; out vec3 v_normal;
void main() {
  vec3 p = in_pos;
  v_cover = 1.0;
  v_normal = in_normal;
#ifdef LINE
  float depth = max((u_clip * vec4(p, 1.0)).w, 0.5);
  float half_width = max(abs(in_uv.y), 0.55 * depth * u_pixel);
  v_cover = abs(in_uv.y) / half_width;
  p += in_normal * half_width * sign(in_uv.y);
  v_normal = vec3(0.0, 0.0, 1.0);
#endif
  p.xy += u_shift;
  v_pos = p; v_uv = in_uv + u_shift; v_rgba = in_rgba;
  v_kind = vec3(floor(in_meta.x * 255.0 + 0.5), floor(in_meta.y * 255.0 + 0.5), 0.0);
  gl_Position = u_clip * vec4(p, 1.0);
  gl_Position.z = (0.9996 - 1e-5 * floor(in_meta.z * 255.0 + 0.5)) * gl_Position.w;
}
