"""How cleanly a painting keeps parts of a scene apart: `python -m tests.bench.regions_painted`.

The still life, whose parts are known, is painted in 6000 strokes; strokes of one part are pure red, all
others pure blue. As in `tests.bench.regions`: the alpha of the wrong colour over that of both, at pixels that
lie some pixels away from the outline of the part in the plain picture. Strokes are real paint: those at an
outline hang over it by half their width. Prints a Markdown table:

- plain: the Gaussians themselves, without strokes.
- mixed: strokes clustered without rules; each has the colour that its Gaussians merge to.
- by rules: no stroke mixes parts.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from brushgs.options.look import Look
from brushgs.options.painting import ClusterConfig, PaintConfig, StrokesConfig, ViewConfig
from brushgs.pipeline.prepare import Prepared, prepare
from brushgs.pipeline.report import Report
from brushgs.rendering.render import render
from brushgs.still_life import still_life
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import base_colors
from tests.bench.regions import REGIONS, SIZE, cameras, in_two_colors, mask_of, owners

STROKES = 6000
EDGES = (2, 8)  # pixels
NUM_VIEWS = 3
LOOKS = ("plain", "oil")


def config_of(look: str) -> PaintConfig:
    """A look without what changes colours, and without ground and lamp."""
    config = PaintConfig() if look == "plain" else Look.open(look).config
    plain = PaintConfig()
    return replace(
        config,
        cluster=ClusterConfig(STROKES),
        strokes=StrokesConfig(broken_color=0.0),
        view=ViewConfig(size=SIZE),
        draw=replace(config.draw, streaks=0.0),
        color=plain.color,
        ground=plain.ground,
        light=plain.light,
    )


def colored(prepared: Prepared, strokes: Gaussians, camera: Camera) -> Frame:
    """The painting with its strokes in other colours."""
    (coat,) = prepared.painting.coats
    return replace(prepared.painting, coats=(replace(coat, strokes=strokes),)).frame(camera)


def leakages(frames: Sequence[Frame], masks: Sequence[np.ndarray]) -> list[float]:
    """For each of `EDGES`, the alpha of the wrong colour over that of both, 0 to 1."""
    from scipy.ndimage import binary_dilation, binary_erosion

    found = []
    for edge in EDGES:
        wrong, total = 0.0, 0.0
        for frame, mask in zip(frames, masks, strict=True):
            inner = binary_erosion(mask, iterations=edge, border_value=1)
            outer = ~binary_dilation(mask, iterations=edge)
            rgb = np.clip(frame.rgb, 0, 1)
            wrong += float(rgb[inner, 2].sum() + rgb[outer, 0].sum())
            total += float(rgb[inner][:, [0, 2]].sum() + rgb[outer][:, [0, 2]].sum())
        found.append(wrong / total)
    return found


def measure(look: str, name: str) -> list[list[float]]:
    """The leakages of plain Gaussians, of mixed strokes, and of strokes by rules."""
    scene, inside = still_life(), np.isin(owners(), list(REGIONS[name]))
    views = cameras(NUM_VIEWS, between=True)
    masks = [mask_of(scene, inside, camera) > 0 for camera in views]
    shown = in_two_colors(scene, inside)
    frames = [[render(shown, camera, "gaussian") for camera in views]]
    config = config_of(look)
    merged = prepare(shown, config, Report(), views=views[0])
    frames.append([colored(merged, merged.strokes, camera) for camera in views])
    ruled = prepare(replace(scene, regions=inside.astype(np.uint8)), config, Report(), views=views[0])
    strokes = in_two_colors(ruled.strokes, ruled.strokes.regions == 1)
    assert np.isin(base_colors(strokes.sh).round(3), (0, 1)).all(), "strokes have pure colours"
    frames.append([colored(ruled, strokes, camera) for camera in views])
    return [leakages(some, masks) for some in frames]


def main() -> None:
    """Measure all regions."""
    heads = [f"{what}, {edge} px" for what in ("plain", "mixed", "by rules") for edge in EDGES]
    print("| look | region | " + " | ".join(heads) + " |\n|---|---|" + "---|" * len(heads))
    for look in LOOKS:
        for name in REGIONS:
            cells = [f"{100 * share:.2f} %" for shares in measure(look, name) for share in shares]
            print(f"| {look} | {name} | " + " | ".join(cells) + " |", flush=True)


if __name__ == "__main__":
    main()
