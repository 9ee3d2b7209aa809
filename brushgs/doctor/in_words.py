"""What is seen of a scene in its first view, in words that are computed."""

from typing import TYPE_CHECKING, Any

from brushgs.values.gaussians import Gaussians

if TYPE_CHECKING:
    from brushgs.passes.style.words import Word
    from brushgs.values.notes import LoadNotes

WIDTH, HEIGHT = 640, 480  # pixels of the view; words do not depend on them but by roundings


def in_words(gaussians: Gaussians, notes: "LoadNotes") -> list[dict[str, Any]]:
    """The words that fit a scene, or strokes: what `brushgs info --words` prints.

    Args:
        gaussians: of a file.
        notes: what the file holds beside them.

    Returns:
        Best first, see `facts_of`; none if nothing is seen.
    """
    from brushgs.cameras.framing import frame_scene
    from brushgs.passes.style.words import words_of_strokes
    from brushgs.pipeline.report import Report
    from brushgs.pipeline.views import default_first_view

    view = default_first_view(gaussians, notes, Report())
    camera = frame_scene(view, width=WIDTH, height=HEIGHT, azimuth=view.azimuth, elevation=view.elevation)
    return facts_of(words_of_strokes(gaussians, camera))


def facts_of(words: "list[Word]") -> list[dict[str, Any]]:
    """Words ready for JSON: each with how well it fits, 0 to 1, and the figure behind it."""
    return [
        {"word": one.word, "fit": round(one.fit, 3), "figure": one.figure, "value": float(f"{one.value:.4g}")}
        for one in words
    ]
