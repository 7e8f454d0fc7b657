"""GLSL programs, one file a stage. Colours are squared before lighting and rooted after it (a gamma of 2).

Software rasterising runs every branch of a shader: what night, wet roads and rain need is compiled in only for them
(``NIGHT``, ``WET``, ``RAIN``). Flat ground, its shadows and the sky are drawn after all upright things, at fixed depths
behind them (0.9999 the sky, 0.9996 and nearer by layer the ground, 0.9993 shadows), so that no pixel is shaded twice.

The colour target's alpha holds the ground's shade (1 open, less in shadow); ``post.frag`` multiplies it in.
"""

from pathlib import Path

_FOLDER = Path(__file__).parent
_INCLUDE = '#include "common.glsl"\n'


def program(stage: str, *defines: str) -> str:
    """The complete shader of a stage's file (``ground.frag``): version, defines, source."""
    source = (_FOLDER / stage).read_text(encoding="utf-8")
    common = (_FOLDER / "common.glsl").read_text(encoding="utf-8")
    return "#version 330\n" + "".join(f"#define {name}\n" for name in defines) + source.replace(_INCLUDE, common)
