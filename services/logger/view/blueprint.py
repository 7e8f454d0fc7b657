"""What the viewer shows, and where: cameras, bird's-eye view, speeds, risk, latencies, messages."""

import rerun as rr
import rerun.blueprint as rrb

SERIES: tuple[tuple[str, str, tuple[int, int, int]], ...] = (
    ("speed/ego", "speed km/h", (90, 170, 255)),
    ("speed/limit", "limit km/h", (230, 60, 60)),
    ("speed/target", "target km/h", (80, 200, 120)),
    ("risk/r", "r", (230, 60, 60)),
    ("risk/delta", "threshold", (150, 150, 150)),
    ("times/ttc_s", "time to collision (up to 20)", (240, 180, 60)),
    ("times/headway_s", "headway (up to 20)", (120, 200, 240)),
)
"""Entity, legend, colour."""

_NO_LEGEND = rrb.PlotLegend(visible=False)
"""It lies over the lines; the title names the colours."""


def blueprint() -> rrb.Blueprint:
    """The layout that a viewer opens with."""
    cameras = rrb.Horizontal(
        rrb.Spatial2DView(origin="camera/front", name="Front"),
        rrb.Spatial2DView(origin="camera/tele", name="Tele"),
    )
    curves = rrb.Vertical(
        rrb.TimeSeriesView(
            origin="speed", name="km/h: speed (blue), limit (red), target (green)", plot_legend=_NO_LEGEND
        ),
        rrb.TimeSeriesView(
            origin="risk", name="Risk r (red), the margin that ACT takes (grey)", plot_legend=_NO_LEGEND
        ),
        rrb.TimeSeriesView(
            origin="times", name="s: time to collision (amber), headway (blue), up to 20", plot_legend=_NO_LEGEND
        ),
        rrb.TimeSeriesView(
            origin="latency", name="Tool latency (ms); a line under the mouse names its tool", plot_legend=_NO_LEGEND
        ),
    )
    bird = rrb.Spatial2DView(
        origin="bird",
        name="From above (m; forward is up)",
        visual_bounds=rrb.VisualBounds2D(x_range=[-30.0, 30.0], y_range=[-90.0, 15.0]),
    )
    words = rrb.Vertical(
        rrb.TextDocumentView(origin="now", name="Now"),
        rrb.TextLogView(origin="messages", name="Messages"),
    )
    return rrb.Blueprint(
        rrb.Vertical(cameras, rrb.Horizontal(bird, curves, words, column_shares=[2, 4, 3]), row_shares=[5, 6]),
        rrb.BlueprintPanel(state="collapsed"),
        rrb.SelectionPanel(state="collapsed"),
        rrb.TimePanel(state="collapsed"),
    )


def name_series(stream: rr.RecordingStream) -> None:
    """Legends and colours, once."""
    for entity, name, color in SERIES:
        stream.log(entity, rr.SeriesLines(names=name, colors=[color], widths=[2.0]), static=True)
