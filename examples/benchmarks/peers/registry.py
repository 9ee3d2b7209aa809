"""The peers, in the order of the table."""

from collections.abc import Callable
from dataclasses import dataclass

from examples.benchmarks.peers.of_brushgs import (
    NO_STAGE,
    FramePainter,
    ScenePainter,
    as_published,
    config_of,
    in_style,
)
from examples.benchmarks.peers.pictures import ColorTransfer, PlainScene, hertzmann, searched
from examples.benchmarks.peers.task import Painter, Task


@dataclass(frozen=True)
class Peer:
    """One row of the table.

    Attributes:
        note: what it is, in a few words.
        open: a painter of a task.
        weights_mb: of trained networks that it needs.
        photographs: of the scene that it needs, beside the scene itself.
    """

    note: str
    open: Callable[[Task], Painter]
    weights_mb: float = 0.0
    photographs: int = 0


PLAIN = "plain scene"
PEERS: dict[str, Peer] = {
    PLAIN: Peer("the Gaussians as trained; all others are compared with it", PlainScene),
    "plain look": Peer("brushgs --look plain", lambda task: ScenePainter(task, config_of("plain", task))),
    "oil": Peer("brushgs, the default", lambda task: ScenePainter(task, config_of("oil", task))),
    "oil, no stage": Peer(
        "brushgs without table and wall",
        lambda task: ScenePainter(task, config_of("oil", task, NO_STAGE)),
    ),
    "oil in the style": Peer(
        "brushgs --style, learned from the painting", lambda task: ScenePainter(task, in_style(task))
    ),
    "as published": Peer(
        "brushgs --preset paper, the rules of BrushGaussian (2025)",
        lambda task: ScenePainter(task, as_published(task)),
    ),
    "Hertzmann": Peer("layers of strokes over each picture (1998)", hertzmann),
    "search": Peer("strokes searched over each picture, in the manner of Im2Oil (2022)", searched),
    "color transfer": Peer("the first step of ARF (2022), no strokes", ColorTransfer),
    "frame by frame": Peer(
        "brushgs in oil, every frame painted alone",
        lambda task: FramePainter(task, config_of("oil", task)),
    ),
}
