#include "common.glsl"
uniform sampler2D u_faces;
in vec2 v_uv; in vec3 v_pos; flat in vec3 v_normal; flat in vec3 v_glow; flat in vec4 v_box;
out vec4 colour;
void main() {
  vec2 inset = vec2(0.0006);
  vec4 texel = texture(u_faces, clamp(v_uv, v_box.xy + inset, v_box.zw - inset));
  if (texel.a < 0.05) discard;
  vec3 to_eye = u_eye - v_pos;
  float dist = length(to_eye);
  vec3 base = gl_FrontFacing ? texel.rgb / max(texel.a, 0.3) : vec3(0.42);
  base = min(base, vec3(1.0)); base *= base;
  vec3 n = gl_FrontFacing ? v_normal : -v_normal;
  vec3 light = mix(u_earth, u_sky, 0.55 + n.z * 0.5) + u_sun * max(dot(n, u_sun_dir), 0.0);
#ifdef NIGHT
  light += street(v_pos, n) + headlight(v_pos) * 0.6;
#endif
  vec3 c = base * light;
  if (gl_FrontFacing) {
#ifdef NIGHT
    {
      float facing = max(dot(n, to_eye) / dist, 0.0);
      float back = v_glow.y * u_beam * facing * 260.0 / (160.0 + dist * dist * 0.10);
      c += base * min(back, 1.15);
    }
#endif
    if (v_glow.x > 0.0) c = base * v_glow.x + vec3(0.004);
  }
  colour = vec4(sqrt(fogged(c, dist)), texel.a);
}
