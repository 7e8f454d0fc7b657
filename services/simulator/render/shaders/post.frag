uniform sampler2D u_image; uniform sampler2D u_grain; uniform sampler2D u_streaks; uniform sampler2D u_drops;
uniform vec2 u_texel; uniform ivec2 u_shift; uniform vec3 u_rain; uniform float u_noise; uniform float u_drop; uniform vec2 u_drop_shift;
uniform vec3 u_streak_colour; uniform float u_gain;
in vec2 v_uv; out vec4 colour;
vec3 tap(vec2 uv) { vec4 t = texture(u_image, uv); return t.rgb * t.a; }
void main() {
  vec2 uv = v_uv;
#ifdef RAIN
  vec3 lens = texture(u_drops, v_uv + u_drop_shift).rgb;
  uv = clamp(uv + (lens.xy - 0.49804) * 0.11 * u_drop, 0.0, 1.0);
#endif
  vec3 c = 0.5 * (tap(uv + u_texel * vec2(0.36, 0.30)) + tap(uv - u_texel * vec2(0.36, 0.30)));
#ifdef RAIN
  vec2 falling = texture(u_streaks, v_uv * vec2(1.3, 0.9) + u_rain.yz).rg;
  c = mix(c, u_streak_colour, min(u_rain.x * (falling.r * 0.62 + falling.g * 0.5), 0.7));
  c *= 1.0 + lens.z * 0.12 * u_drop;
#endif
  vec2 q = v_uv - 0.5;
  c *= u_gain * (1.03 - 0.42 * dot(q, q));
  vec3 grain = texelFetch(u_grain, (ivec2(gl_FragCoord.xy) + u_shift) & 255, 0).rgb - 0.5;
  c += (grain.g + 0.35 * grain) * u_noise * (1.15 - 0.6 * c.g);
  colour = vec4(c, 1.0);
}
