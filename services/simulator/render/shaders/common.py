"""GLSL programs. Colours are squared before lighting and rooted after it (a gamma of 2).

Software rasterising runs every branch of a shader: what night, wet roads and rain need is compiled in only for them
(``NIGHT``, ``WET``, ``RAIN``). Flat ground, its shadows and the sky are drawn after all upright things, at fixed depths
behind them (0.9999 the sky, 0.9996 and nearer by layer the ground, 0.9993 shadows), so that no pixel is shaded twice.

The colour target's alpha holds the ground's shade (1 open, less in shadow); ``POST`` multiplies it in.
"""

from __future__ import annotations

HEADER = "#version 330\n"

COMMON = """
uniform vec3 u_eye; uniform vec3 u_sun_dir; uniform vec3 u_sun; uniform vec3 u_sky; uniform vec3 u_earth;
uniform vec3 u_fog; uniform float u_beta; uniform vec3 u_zenith; uniform vec3 u_horizon;
uniform float u_wet;
#ifdef NIGHT
uniform vec3 u_beam_pos; uniform vec3 u_beam_dir; uniform float u_beam;
uniform vec4 u_street[6]; uniform int u_streets;

float headlight(vec3 p) {
  vec3 d = p - u_beam_pos;
  float x = dot(d.xy, u_beam_dir.xy);
  if (x < 0.3) return 0.0;
  float y = d.x * -u_beam_dir.y + d.y * u_beam_dir.x;
  float t = y / (x + 1.0), rise = (d.z + 0.012 * x) / (x + 2.0);
  float wide = exp(-t * t * 7.0);
  float cut = mix(1.0, 0.26, smoothstep(-0.01, 0.04, rise));
  return u_beam * wide * cut * 60.0 / (60.0 + x * x * 0.11) * smoothstep(0.3, 7.0, x);
}
vec3 street(vec3 p, vec3 n) {
  vec3 sum = vec3(0.0);
  for (int k = 0; k < u_streets; ++k) {
    vec3 d = u_street[k].xyz - p;
    float r2 = dot(d, d);
    float lit = max(dot(n, d) * inversesqrt(r2), 0.0);
    sum += vec3(1.0, 0.80, 0.52) * lit * 26.0 / (30.0 + r2 * (0.25 + r2 * 0.02));
  }
  return sum;
}
#endif
vec3 fogged(vec3 c, float dist) { return mix(u_fog, c, exp(-u_beta * dist)); }
"""


def program(source: str, *defines: str) -> str:
    """A complete shader: version, defines, source."""
    return HEADER + "".join(f"#define {name}\n" for name in defines) + source
