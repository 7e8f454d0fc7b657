uniform mat4 u_clip; uniform mat4 u_model; uniform float u_lamp[16]; uniform float u_phase;
in vec3 in_pos; in vec3 in_normal; in vec2 in_uv; in vec4 in_rgba; in vec4 in_meta;
#ifdef INSTANCED
in vec4 in_place; in vec4 in_look;
#endif
out vec3 v_pos; out vec3 v_normal; out vec3 v_uv; out vec3 v_rgb; out vec4 v_kind;
vec3 swung(vec3 p, float pivot, float a) {
  float c = cos(a), s = sin(a), z = p.z - pivot;
  return vec3(c * p.x + s * z, p.y, -s * p.x + c * z + pivot);
}
vec3 turned(vec3 n, float a) { return swung(n, 0.0, a); }
void main() {
  vec3 p = in_pos, n = in_normal;
  int layer = int(in_meta.x * 255.0 + 0.5), material = int(in_meta.y * 255.0 + 0.5), joint = int(in_meta.z * 255.0 + 0.5);
  if (joint > 0) {
    float sgn = (joint == 1 || joint == 3 || joint == 6) ? 1.0 : -1.0;
    if (joint == 3 || joint == 4) {
      float bend = 0.75 * max(0.0, cos(6.2831853 * u_phase) * sgn);
      p = swung(p, 0.28, bend); n = turned(n, bend);
    }
    float angle = -sgn * sin(6.2831853 * u_phase) * (joint >= 5 ? 0.42 : 0.48);
    p = swung(p, joint >= 5 ? 0.80 : 0.51, angle); n = turned(n, angle);
  }
#ifdef INSTANCED
  float c = cos(in_place.w), s = sin(in_place.w);
  vec3 q = p * vec3(in_look.x, in_look.x, in_look.y);
  vec4 world = vec4(vec3(c * q.x - s * q.y, s * q.x + c * q.y, q.z) + in_place.xyz, 1.0);
  v_normal = vec3(c * n.x - s * n.y, s * n.x + c * n.y, n.z);
  v_rgb = in_rgba.rgb * vec3(in_look.z, 1.0, in_look.w);
#else
  vec4 world = u_model * vec4(p, 1.0);
  v_normal = mat3(u_model) * n;
  v_rgb = in_rgba.rgb;
#endif
  v_pos = world.xyz;
  v_uv = vec3(in_uv, float(layer));
  float gloss = material == 1 ? 1.0 : (material == 2 ? 0.35 : (material == 15 ? 0.5 : 0.0));
  float special = material == 8 ? 1.0 : (material == 10 ? 2.0 : 0.0);
  v_kind = vec4(u_lamp[material], gloss, special, material == 14 ? 1.0 : 0.0);
  gl_Position = u_clip * world;
}
