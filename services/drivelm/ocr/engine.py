"""Character recognition with the PyPI package ``rapidocr``, where it is installed: one engine on one thread, off the hot path."""

from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from importlib.util import find_spec
from typing import Any

from services.drivelm.reading.crops import Picture

Recognise = Callable[[Picture], tuple[str, float]]
"""A picture (uint8 H x W x 3 RGB) to the text on it and how sure that is; empty: none."""


def available() -> bool:
    """Whether the recogniser is installed."""
    return find_spec("rapidocr") is not None


def one_thread() -> ThreadPoolExecutor:
    """The thread that all recognition shares: it may take as long as it takes, and never more than one core."""
    return ThreadPoolExecutor(max_workers=1, thread_name_prefix="ocr")


class Engine:
    """``rapidocr``, loaded when it is first used. All calls belong to one thread."""

    def __init__(self) -> None:
        self._loaded: Any = None

    def largest_line(self, board: Picture, least_px: float) -> tuple[str, float]:
        """The tallest line of text that is found on a board, if it is at least so high. Takes seconds."""
        found = self._engine()(board[..., ::-1])
        if found.txts is None or found.boxes is None:
            return "", 0.0
        heights = [float(box[:, 1].max() - box[:, 1].min()) for box in found.boxes]
        best = max(range(len(heights)), key=lambda index: heights[index])
        return (found.txts[best], float(found.scores[best])) if heights[best] >= least_px else ("", 0.0)

    def line(self, text: Picture) -> tuple[str, float]:
        """What a picture of one line of text says; nothing is looked for in it. Takes some 0.1 s."""
        found = self._engine()(text[..., ::-1], use_det=False, use_cls=False, use_rec=True)
        return (found.txts[0], float(found.scores[0])) if found.txts else ("", 0.0)

    def _engine(self) -> Any:
        if self._loaded is None:
            from rapidocr import RapidOCR

            self._loaded = RapidOCR(params={"EngineConfig.onnxruntime.intra_op_num_threads": 1})
        return self._loaded
