uniform sampler2DArray u_surfaces; uniform vec3 u_fog;
in vec3 v_uv; in vec3 v_rgb; in vec4 v_light;
out vec4 colour;
void main() {
  vec4 texel = texture(u_surfaces, v_uv);
  if (texel.a < 0.42) discard;
  vec3 base = texel.rgb * v_rgb;
  colour = vec4(sqrt(mix(u_fog, base * base * v_light.rgb, v_light.a)), 1.0);
}
