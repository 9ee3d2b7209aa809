"""How well painted masks say which Gaussians are meant: `python -m tests.bench.regions`.

The truth is known on the still life: which body each Gaussian was made for. A mask is what a region paints in
a view of the whole scene, white where it makes up half of a pixel or more. From some masks, made from an arc
of 150 degrees before the wall, the Gaussians of the region are found again. Prints Markdown tables:

- IoU: the Gaussians that are both found and true, over those that are either. Of all Gaussians, hidden ones
  too; and by what they make up of the views between those of the masks, which is what anyone will see.
- Leakage: what is found is painted pure red, all else pure blue, without view-dependent terms. In views
  between those of the masks: the alpha of the wrong colour over that of both, over all pixels that are
  `EDGE` pixels and more away from the outline of the region, where one pixel shows both. By true Gaussians it
  is what lies in the scene itself: surfaces are not opaque, and footprints cross outlines.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from brushgs.options.where import Where
from brushgs.passes.where import WhereContext, memberships
from brushgs.passes.where.masks import MaskView
from brushgs.rendering.render import render
from brushgs.rendering.visibility import visible_areas
from brushgs.still_life import NUM_GAUSSIANS, still_life
from brushgs.still_life.bodies import bodies
from brushgs.still_life.cast import cast_of, joined
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0

SIZE = (640, 480)
NUM_MASKS = (1, 3, 5, 9)
NUM_BETWEEN = 7  # views that leakage is measured in
TARGET, DISTANCE, FOV_Y = (0.12, -1.42, 0.2), 10.6, np.radians(34.0)
ARC, ELEVATIONS = np.radians(75.0), np.radians((14.0, 38.0))  # to each side; of views in turn
EDGE = 2  # pixels
RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
# Numbers of their bodies, as `bodies` yields them.
REGIONS = {
    "cloth": range(2, 3),
    "jug": range(3, 5),
    "bottle": range(5, 6),
    "bowl": range(6, 7),
    "oranges": range(7, 11),
    "pear": range(13, 15),
    "all but wall and table": range(2, 100),
}


def owners(num_gaussians: int = NUM_GAUSSIANS, seed: int = 0):
    """[N] the number of the body that each Gaussian of the still life was made for."""
    rng = np.random.default_rng(seed)
    cast = joined(
        [cast_of(body, number, rng) for number, body in enumerate(list(bodies(num_gaussians, rng)))]
    )
    return cast.surface.bodies[cast.opacities > 1 / 255]


def cameras(num: int, *, between: bool = False, size: tuple[int, int] = SIZE) -> list[Camera]:
    """Views along the arc; those `between` stand where those of masks do not."""
    places = (np.arange(num) + 0.5) / num if between or num == 1 else np.linspace(0, 1, num)
    found = []
    for number, place in enumerate(places):
        azimuth, elevation = (2 * place - 1) * ARC, ELEVATIONS[(number + between) % 2]
        away = np.cos(elevation) * np.sin(azimuth), -np.sin(elevation), -np.cos(elevation) * np.cos(azimuth)
        eye = np.array(TARGET) + DISTANCE * np.array(away)
        width, height = size
        found.append(Camera.look_at(eye, TARGET, width=width, height=height, fov_y=float(FOV_Y)))
    return found


def in_two_colors(gaussians: Gaussians, inside, one=RED, other=BLUE) -> Gaussians:
    """Gaussians in one colour inside, and another outside."""
    colors = np.where(inside[:, None], one, other)
    return replace(gaussians, sh=((colors - 0.5) / C0)[:, None].astype(gaussians.sh.dtype))


def mask_of(gaussians: Gaussians, inside, camera: Camera):
    """[H, W] 1 where a region makes up half of a pixel or more."""
    frame = render(in_two_colors(gaussians, inside), camera, "gaussian")
    return (frame.rgb[..., 0] >= 0.5).astype(np.float32)


def find(gaussians: Gaussians, inside, num_masks: int):
    """[N] what masks of a region say is in it."""
    views = [
        MaskView(camera, mask_of(gaussians, inside, camera), np.ones((camera.height, camera.width)))
        for camera in cameras(num_masks)
    ]
    context = WhereContext(open_masks=lambda path: views)
    return memberships(Where.parse("mask:painted"), gaussians, context) == 1


def iou(found, truth, weights=None) -> float:
    """Intersection over union of two masks of Gaussians, 0 to 1."""
    weights = np.ones(len(truth)) if weights is None else weights
    return float(weights[found & truth].sum() / weights[found | truth].sum())


def leakage(gaussians: Gaussians, found, truth, views: Sequence[Camera]) -> float:
    """Alpha of the wrong colour over that of both, away from outlines, 0 to 1."""
    from scipy.ndimage import binary_dilation, binary_erosion

    wrong, total = 0.0, 0.0
    for camera in views:
        mask = mask_of(gaussians, truth, camera) > 0
        rgb = render(in_two_colors(gaussians, found), camera, "gaussian").rgb
        inner = binary_erosion(mask, iterations=EDGE, border_value=1)
        outer = ~binary_dilation(mask, iterations=EDGE)
        wrong += float(rgb[inner, 2].sum() + rgb[outer, 0].sum())
        total += float(rgb[inner].sum() + rgb[outer].sum())
    return wrong / total


def main() -> None:
    """Measure all regions."""
    scene, owner = still_life(), owners()
    between = cameras(NUM_BETWEEN, between=True)
    seen = sum(visible_areas(scene, camera) for camera in between)
    ious, leaks = [], []
    for name, numbers in REGIONS.items():
        truth = np.isin(owner, list(numbers))
        found = {num: find(scene, truth, num) for num in NUM_MASKS}
        cells = [f"{iou(found[num], truth):.3f} ({iou(found[num], truth, seen):.3f})" for num in NUM_MASKS]
        ious.append(f"| {name} | {int(truth.sum()):,} | " + " | ".join(cells) + " |")
        shares = [leakage(scene, some, truth, between) for some in (*found.values(), truth)]
        leaks.append(f"| {name} | " + " | ".join(f"{100 * share:.2f} %" for share in shares) + " |")
        print(ious[-1], leaks[-1], flush=True)
    heads = " | ".join(f"{num} mask{'s' * (num > 1)}" for num in NUM_MASKS)
    print(f"\n| region | Gaussians | {heads} |\n|---|---|{'---|' * len(NUM_MASKS)}")
    print("\n".join(ious))
    print(f"\n| region | {heads} | true Gaussians |\n|---|{'---|' * (len(NUM_MASKS) + 1)}")
    print("\n".join(leaks))


if __name__ == "__main__":
    main()
