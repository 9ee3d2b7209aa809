"""How well each Gaussian matches words, 0 to 1, by a model of pictures and words from the user.

    views all around -> windows of several scales -> similarity of each patch to the words and to phrases that
    fit anything -> votes on Gaussians -> relevance

The model (`Encoder`) only compares patches of a picture with words; the rest does not depend on it. Each
patch votes with its similarity on its Gaussians, over all views. Since similarity is linear, the result is
the similarity of the mean feature over all visible parts of a Gaussian.

The quality with real weights has not been measured, since none come with brushgs. Tests cover the vote, with
a model of known answers, and the code path of a real model with random weights.
Sources: Kerr et al. 2023, LERF (canonical phrases, scales); Qin et al. 2024, LangSplat (several views, one
answer for each Gaussian).
"""

from collections.abc import Sequence
from pathlib import Path
from typing import Protocol

import numpy as np
from scipy.spatial import cKDTree

from brushgs.cameras.around import ring_views
from brushgs.formats.pictures.images import resize
from brushgs.passes.color.picture_votes import votes
from brushgs.rendering.plain import plain_views
from brushgs.values.arrays import F32, F64
from brushgs.values.camera import Camera, FirstView
from brushgs.values.gaussians import Gaussians

CANONICAL = ("object", "things", "stuff", "texture")  # phrases that fit anything, from LERF
SHARPNESS = 10.0  # factor on cosines before comparison, from LERF; without effect on a relevance of 1/2
VIEW = 448  # pixels: views are square, like the windows of CLIP; `small_view` sets the size
SCALES = (1.0, 2.0)  # shorter side of the picture in windows: the whole, and parts
BACKGROUND = 0.5  # gray behind a scene: near the mean of the training pictures of models
SEEN = 0.05  # pixels over all views; Gaussians with less take the value of their nearest visible neighbor


class Encoder(Protocol):
    """A model that maps patches of pictures and words to one space.

    Attributes:
        side: of its windows, patches.
        patch: side of a patch, pixels.
    """

    side: int
    patch: int

    def of_words(self, words: Sequence[str]) -> F64:
        """[T, D] unit vectors of T phrases."""
        ...

    def of_windows(self, windows: F32) -> F64:
        """[B, side, side, D] unit vectors of the patches of B windows.

        Args:
            windows: [B, side x patch, side x patch, 3] display-encoded RGB, 0 to 1.
        """
        ...


def word_finder(
    gaussians: Gaussians,
    model_folder: str | Path,
    first_view: FirstView,
    *,
    num_threads: int | None = None,
) -> "WordFinder":
    """Prepare queries: how well Gaussians fit words, by a CLIP model in a folder of the user.

    Args:
        gaussians: N >= 1 Gaussians.
        model_folder: see `brushgs.passes.where.clip.ClipEncoder`.
        first_view: of the scene: the views are a ring that begins with it.
        num_threads: None takes the processors available to this process.

    Raises:
        SceneError: if the model cannot be used, or a library that it needs is missing.
    """
    from brushgs.passes.where.clip import ClipEncoder

    encoder = ClipEncoder(model_folder)
    return WordFinder(encoder, gaussians, ring_views(first_view, VIEW, VIEW), num_threads=num_threads)


class WordFinder:
    """Features of a scene by a model, for queries by words."""

    def __init__(
        self,
        encoder: Encoder,
        gaussians: Gaussians,
        cameras: Sequence[Camera],
        *,
        num_threads: int | None = None,
    ) -> None:
        """Show plain pictures of a scene to a model.

        Args:
            encoder: the model.
            gaussians: N >= 1 Gaussians.
            cameras: the views.
            num_threads: None takes the processors available to this process.
        """
        self._encoder, self._gaussians, self._cameras = encoder, gaussians, cameras
        self._num_threads = num_threads
        frames = plain_views(gaussians, cameras, num_threads=num_threads).frames
        self._alphas = [frame.alpha for frame in frames]
        self._grids = [patch_grids(encoder, frame.over((BACKGROUND,) * 3)) for frame in frames]

    def relevance(self, words: str) -> F64:
        """[N] how well each Gaussian fits words such as "the truck", 0 to 1.

        1/2 means as well as the best of `CANONICAL`, which fit anything: higher values are matches.

        Raises:
            ValueError: if there are more words than the model takes.
        """
        phrases = self._encoder.of_words((words, *CANONICAL))
        pictures = [
            similarities(grids, phrases, *alpha.shape)
            for grids, alpha in zip(self._grids, self._alphas, strict=True)
        ]
        sums, weights = votes(
            self._gaussians,
            self._cameras,
            pictures,
            pixel_weights=self._alphas,
            num_threads=self._num_threads,
        )
        is_seen = weights > SEEN
        found = np.zeros(len(self._gaussians))
        if not is_seen.any():
            return found
        found[is_seen] = relevance(sums[is_seen] / weights[is_seen, None])
        # The inside of an object is invisible, but belongs to it.
        means = self._gaussians.means
        nearest = cKDTree(means[is_seen]).query(means[~is_seen])[1]
        found[~is_seen] = found[is_seen][nearest]
        return found


def relevance(similar: F64) -> F64:
    """[n] softmax share of the words against the best canonical phrase.

    Args:
        similar: [n, 1 + P] cosines to the words, and to P phrases.
    """
    best = similar[:, 1:].max(axis=1)
    return np.asarray(1 / (1 + np.exp(SHARPNESS * (best - similar[:, 0]))))


def similarities(grids: Sequence[F32], phrases: F64, height: int, width: int) -> F32:
    """Cosine of each pixel's feature to each phrase, mean over scales.

    Args:
        grids: see `patch_grids`.
        phrases: [T, D] unit vectors.
        height: of the picture, pixels.
        width: of the picture, pixels.

    Returns:
        [height, width, T].
    """
    found = [resize(grid @ phrases.T, width, height, edges="nearest") for grid in grids]
    return np.asarray(np.mean(found, axis=0), np.float32)


def patch_grids(encoder: Encoder, picture: F32) -> list[F32]:
    """Features of the patches of a picture, at each of `SCALES`.

    Args:
        encoder: the model.
        picture: [h, w, 3] display-encoded RGB, 0 to 1.

    Returns:
        [rows, columns, D] each: patches over the whole picture, with means of overlapping windows.
    """
    height, width = picture.shape[:2]
    grids = []
    for scale in SCALES:
        short = scale * encoder.side / min(height, width)  # patches per pixel
        rows, columns = (max(round(length * short), encoder.side) for length in (height, width))
        larger = resize(picture, columns * encoder.patch, rows * encoder.patch, edges="nearest")
        grids.append(_grid(encoder, np.clip(larger, 0, 1).astype(np.float32)))
    return grids


def _grid(encoder: Encoder, picture: F32) -> F32:
    """[rows, columns, D] of a picture whose sides are whole numbers of patches, not below a window."""
    side, patch = encoder.side, encoder.patch
    rows, columns = picture.shape[0] // patch, picture.shape[1] // patch
    places = [(top, left) for top in starts(rows, side) for left in starts(columns, side)]
    windows = [picture[top * patch :, left * patch :][: side * patch, : side * patch] for top, left in places]
    found = encoder.of_windows(np.stack(windows))
    sums, counts = np.zeros((rows, columns, found.shape[-1])), np.zeros((rows, columns, 1))
    for (top, left), one in zip(places, found, strict=True):
        sums[top : top + side, left : left + side] += one
        counts[top : top + side, left : left + side] += 1
    return (sums / counts).astype(np.float32)


def starts(length: int, side: int) -> list[int]:
    """Starts of evenly spread windows that cover a length and overlap by at least half."""
    count = 1 + int(np.ceil((length - side) / max(side // 2, 1)))
    return [int(start) for start in np.linspace(0, length - side, count).round()]
