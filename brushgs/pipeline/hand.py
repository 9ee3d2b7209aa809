"""From the options of a film made by hand to the changes of its boxes, and a warning of flashing pictures."""

import warnings
from collections.abc import Callable, Iterable, Iterator, Sequence
from math import ceil
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from brushgs.errors import SceneWarning
from brushgs.options.hand import WAVES
from brushgs.options.painting import PaintConfig
from brushgs.pipeline.media.materials import ACCENTS, BACKDROP
from brushgs.pipeline.report import Report
from brushgs.rendering.coat import Coat
from brushgs.rendering.hand import Hand, Rhythm, with_holds
from brushgs.rendering.places import projected
from brushgs.values.arrays import F32, F64, Array
from brushgs.values.camera import Camera
from brushgs.values.colors import LUMINANCE, linear_from_srgb

if TYPE_CHECKING:
    from brushgs.cameras.paths import CameraPath

FLASH = 0.1  # relative luminance by which a picture changes and changes back, and its darker side
DARK = 0.8  # below which that counts
MOST_FLASHES = 3  # a second
MOST_AREA = 0.25  # of a window of a third of width and height: 10 degrees of a screen at arm's length
PROBED_SIDE = 160  # pixels, longer side of the checked frames


def open_hand(config: PaintConfig, path: "CameraPath", coats: Iterable[Coat]) -> Hand | None:
    """How a film is made by hand; None if it is not.

    Args:
        config: of the film.
        path: of its camera.
        coats: of all of its strokes.

    Raises:
        SceneError: if the picture that a wave follows cannot be read.
    """
    if not config.is_by_hand:
        return None
    coats, hand = list(coats), config.hand
    paces = with_holds(config.paces, coats)
    rhythms = {}
    frames = path.fps, len(path.cameras), path.is_loop
    if any(pace.redraw for pace in paces):
        seconds = len(path.cameras) / path.fps
        rhythms = {
            coat.name: Rhythm.of(
                coat,
                paces,
                seconds,
                is_loop=path.is_loop,
                places=_places(hand.redraw_from, coat, path.cameras[0]),
            )
            for coat in coats
            if coat.name not in (BACKDROP, ACCENTS) and len(coat.strokes)
        }
    return Hand(paces, hand.boil_every, hand.hold_camera, *frames, rhythms, BACKDROP, hand.smear)


def _places(origin: Path | None, coat: Coat, camera: Camera) -> F64 | None:
    """[N] positions of the strokes of a coat along a wave, 0 to 1."""
    if origin is None:
        return None
    rows = np.arange(len(coat.strokes), dtype=np.int32)
    size = np.array([camera.width, camera.height], np.float64)
    at = projected(coat, rows, camera) / size
    name = str(origin)
    if name in ("near", "far"):
        depths = coat.strokes.means.astype(np.float64) @ camera.viewmat[2, :3]
        ranks = np.argsort(np.argsort(depths, kind="stable"), kind="stable") / max(len(depths), 1)
        return np.asarray(ranks if name == "near" else 1 - ranks)
    if name in WAVES:
        x, y = at.T
        aside = np.hypot(*((at - 0.5) * size).T) / (0.5 * np.hypot(*size))
        ways = {"left": x, "right": 1 - x, "top": y, "bottom": 1 - y, "center": aside}
        return np.asarray(ways[name].clip(0, 1))
    return _on_map(origin, at)


def _on_map(file: Path, at: F64) -> F64:
    """[N] lightness of a picture at positions in it, 0 to 1."""
    from brushgs.formats.pictures.images import read_image
    from brushgs.values.colors import split_alpha

    picture, _ = split_alpha(read_image(file))
    light = picture.mean(axis=2)
    rows, columns = ((at * light.shape[::-1]).astype(np.intp).T)[::-1]
    found: F64 = light[rows.clip(0, light.shape[0] - 1), columns.clip(0, light.shape[1] - 1)].astype(float)
    return found


def describe_hand(hand: Hand | None, small: Callable[[int], Iterator[Array]], report: Report) -> None:
    """Report how a film is made, and warn if it flashes, see `flashing_area`.

    Args:
        hand: None for a steady film: then no frame is painted.
        small: gives its frames with a longer side of the given number of pixels, painted on demand.
        report: gets the stage.
    """
    if hand is None:
        return
    with report.stage("hand") as stage:
        paces = [f"hold {one.hold}, boil {one.boil:g}, redraw {one.redraw:g}" for one in hand.paces]
        stage.did = "; ".join(dict.fromkeys(paces))
        if not hand.changes or hand.fps < 2 * MOST_FLASHES:
            return
        seconds = [frame for frame, _ in zip(small(PROBED_SIDE), range(ceil(hand.fps)), strict=False)]
        area = flashing_area(seconds, hand.fps)
        stage.counts = {"flashing": round(area, 3)}
        stage.details.append(f"at most {area:.1%} of a part of the picture flashes")
        if area > MOST_AREA:
            fact = f"{area:.0%} of a part of the picture flashes more than {MOST_FLASHES} times a second"
            cure = "take less --boil or --redraw, or a longer --boil-every"
            warnings.warn(SceneWarning(f"{fact}, which can harm viewers; {cure}"), stacklevel=2)


def flashing_area(pictures: Sequence[Array], fps: float) -> float:
    """The largest share of a window of a film that flashes more often than is safe, 0 to 1.

    A flash is a change of relative luminance by a tenth or more, and back, whose darker side is under 0.8.
    Windows have a third of the width and height. Source: WCAG 2.2, general flash thresholds.

    Args:
        pictures: [H, W, 3] opaque, display-encoded, in order.
        fps: frames a second.
    """
    from scipy.ndimage import uniform_filter

    luminances = np.stack([_luminance(picture) for picture in pictures])
    low = high = last = luminances[0]
    turns, rising = np.zeros(last.shape), np.zeros(last.shape, np.int8)
    for luminance in luminances[1:]:
        low, high = np.minimum(low, luminance), np.maximum(high, luminance)
        rises = (luminance - low >= FLASH) & (low < DARK) & (rising <= 0)
        falls = (high - luminance >= FLASH) & (luminance < DARK) & (rising >= 0)
        turns += rises | falls
        rising = np.where(rises, 1, np.where(falls, -1, rising)).astype(np.int8)
        low = np.where(rises | falls, luminance, low)
        high = np.where(rises | falls, luminance, high)
    seconds = max((len(luminances) - 1) / fps, 1e-9)
    flashes = 0.5 * turns / seconds > MOST_FLASHES
    window = [max(side // 3, 1) for side in flashes.shape]
    return float(uniform_filter(flashes.astype(np.float64), window, mode="constant").max())


def _luminance(picture: Array) -> F32:
    light = linear_from_srgb(np.clip(picture, 0, 1))
    return np.asarray(light @ np.array(LUMINANCE, np.float32), np.float32)
