"""GLSL for glare around lamps and for the sensor's last word on the picture."""

from __future__ import annotations

GLOW_VERTEX = """
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
"""

GLOW_FRAGMENT = """
uniform float u_beta;
in vec2 v_spot; flat in vec3 v_colour; flat in float v_dist;
out vec4 colour;
void main() {
  float r2 = dot(v_spot, v_spot);
  if (r2 > 1.0) discard;
  float fall = 1.0 - r2;
  colour = vec4(v_colour * (fall * fall * fall) * exp(-u_beta * v_dist * 0.7), 0.0);
}
"""

POST_VERTEX = """
in vec2 in_corner; out vec2 v_uv;
void main() { v_uv = vec2(in_corner.x, -in_corner.y) * 0.5 + 0.5; gl_Position = vec4(in_corner, 0.0, 1.0); }
"""

POST_FRAGMENT = """
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
"""
