"""Describe the first view of a scene in computed words."""

from typing import TYPE_CHECKING, Any

from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.passes.style.words import Word
    from brushgs.values.notes import LoadNotes

WIDTH, HEIGHT = 640, 480  # pixels of the view; words depend on them only by rounding


def in_words(gaussians: Gaussians, notes: "LoadNotes") -> list[dict[str, Any]]:
    """Words that fit a scene, or strokes, as printed by `brushgs info --words`.

    Args:
        gaussians: the Gaussians of a file.
        notes: notes on the file.

    Returns:
        Best first, see `facts_of`; empty if nothing is visible.
    """
    from brushgs.cameras.framing import frame_scene
    from brushgs.passes.style.words import words_of_strokes
    from brushgs.pipeline.report import Report
    from brushgs.pipeline.views import default_first_view

    view = default_first_view(gaussians, notes, Report())
    camera = frame_scene(view, width=WIDTH, height=HEIGHT, azimuth=view.azimuth, elevation=view.elevation)
    return facts_of(words_of_strokes(gaussians, camera))


def facts_of(words: "list[Word]") -> list[dict[str, Any]]:
    """Words ready for JSON: each with its fit, 0 to 1, and its figure."""
    return [
        {"word": one.word, "fit": round(one.fit, 3), "figure": one.figure, "value": float(f"{one.value:.4g}")}
        for one in words
    ]
