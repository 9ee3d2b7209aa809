"""Half of a paint-over of the still life continued: how far the other half is from what was painted there.

python -m examples.benchmarks.continue_marks

Rules paint three bodies, each in its own direction and with its own shift of colors, as marks on the
surface. The left half of each is given to `--continue`; the right half is compared: the direction of the
nearest stroke, in the plane of the mark, and the color that the picture shows at its place. Then the same
is asked of every look without marks.
"""

from dataclasses import replace
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple

import numpy as np

import brushgs as bg
from brushgs.formats.marks import write_marks
from brushgs.options.choices import LOOKS
from brushgs.options.look import config_of
from brushgs.options.overpaint import OverpaintConfig
from brushgs.options.painting import PaintConfig
from brushgs.passes.form.planes import Planes
from brushgs.pipeline.media.materials import BACKDROP
from brushgs.pipeline.prepare import prepare
from brushgs.pipeline.report import Report
from brushgs.still_life import still_life, still_life_camera
from brushgs.still_life.bodies import bodies
from brushgs.still_life.cast import cast_of
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera
from brushgs.values.colors import oklab_of, rgb_of_oklab
from brushgs.values.marks import NO_TILE, Marks, Overpaint
from brushgs.values.sh import base_colors

# Bodies by number, the shift of their colors in OKLab, and the direction of the marks.
RULES = (
    ((2,), (-0.10, 0.03, -0.10), (1, 1, 0)),  # the cloth
    ((3,), (0.15, 0.08, 0.10), (1, 0, 1)),  # the jug
    ((7, 8, 9, 10), (-0.08, -0.15, -0.08), (0, 1, 0)),  # the oranges
)
MOST_EACH, LEAST_EACH = 150, 12  # marks of a rule
ASPECT = 3.0


class Error(NamedTuple):
    """How far a painting is from the half that was held out: degrees, and OKLab."""

    direction: float
    color: float


def bodies_of(num_gaussians: int) -> "tuple[bg.Gaussians, np.ndarray]":
    """The still life, and the number of the body of each Gaussian."""
    rng = np.random.default_rng(0)
    casts = [cast_of(body, number, rng) for number, body in enumerate(list(bodies(num_gaussians, rng)))]
    numbers = np.repeat(np.arange(len(casts)), [len(cast.means) for cast in casts])
    return still_life(num_gaussians), numbers[np.concatenate([cast.opacities for cast in casts]) > 1 / 255]


def paint_over(scene: bg.Gaussians, numbers: "np.ndarray", camera: Camera) -> tuple[Marks, Marks]:
    """The marks that are given, and those that are held out: visible ones on the front."""
    lab, planes = oklab_of(base_colors(scene.sh)), Planes.of(scene)
    toward = camera.position - scene.means
    normals = planes.axes[:, 2] * np.sign((planes.axes[:, 2] * toward).sum(axis=1))[:, None]
    is_front = (normals * toward).sum(axis=1) > 0.3 * np.linalg.norm(toward, axis=1)
    is_front &= _is_seen(scene, camera)
    parts: list[list[Marks]] = [[], []]
    for numbers_painted, shift, wanted in RULES:
        rows = np.flatnonzero(is_front & np.isin(numbers, numbers_painted))
        rows = rows[:: -(-len(rows) // MOST_EACH)]
        assert len(rows) >= LEAST_EACH, "the rule finds too little"
        normal = normals[rows]
        direction = np.asarray(wanted, float) - (normal @ np.asarray(wanted, float))[:, None] * normal
        width = np.median(2 * planes.sizes[rows])
        lines = Marks(
            scene.means[rows] + 0.1 * width * normal,
            direction / np.linalg.norm(direction, axis=1, keepdims=True),
            normal,
            np.full(len(rows), ASPECT * width),
            np.full(len(rows), width),
            np.clip(rgb_of_oklab(lab[rows] + shift), 0, 1),
            np.ones(len(rows)),
            np.full(len(rows), NO_TILE),
        )
        is_left = lines.means[:, 0] < np.median(lines.means[:, 0])
        parts[0].append(lines.take(is_left))
        parts[1].append(lines.take(~is_left))
    given, held_out = (Overpaint.joined([Overpaint(one) for one in some]).marks for some in parts)
    assert given is not None
    assert held_out is not None
    return given, held_out


def error_of(scene: bg.Gaussians, config: PaintConfig, camera: Camera, wanted: Marks) -> Error:
    """Medians over the marks that are wanted."""
    painting = prepare(scene, config, Report(), views=camera, asks=["painting"]).painting
    frame = painting.frame(camera)
    x, y, _ = _in_picture(wanted.means, camera)
    shown = oklab_of(np.asarray(frame.rgb + 1 - frame.alpha[..., None], np.float64)[y, x].clip(0, 1))
    colors = np.linalg.norm(shown - oklab_of(wanted.colors), axis=1)
    coats = [coat.strokes for coat in painting.coats if coat.name not in (BACKDROP, "marks")]
    means = np.concatenate([strokes.means for strokes in coats]).astype(np.float64)
    axes = np.concatenate([Planes.of(strokes).axes[:, 0] for strokes in coats])
    nearest = ((wanted.means[:, None] - means) ** 2).sum(axis=2).argmin(axis=1)
    along = axes[nearest] - (axes[nearest] * wanted.normals).sum(axis=1)[:, None] * wanted.normals
    cosines = np.abs((along * wanted.directions).sum(axis=1)) / np.linalg.norm(along, axis=1).clip(1e-12)
    return Error(float(np.median(np.degrees(np.arccos(cosines.clip(0, 1))))), float(np.median(colors)))


def errors(
    num_gaussians: int, num_strokes: int, width: int, looks: list[str], continued: list[str]
) -> dict[str, Error]:
    """Of looks without marks, and of those that continue them."""
    scene, numbers = bodies_of(num_gaussians)
    camera = still_life_camera(width=width, height=3 * width // 4)
    given, held_out = paint_over(scene, numbers, camera)
    found = {}
    with TemporaryDirectory() as folder:
        path = Path(folder) / "half.marks"
        write_marks(Overpaint(given), path)
        for name in dict.fromkeys(looks + continued):
            config = config_of(name)
            config = replace(config, cluster=replace(config.cluster, strokes=num_strokes))
            if name in looks:
                found[name] = error_of(scene, config, camera, held_out)
            if name in continued:
                config = replace(config, overpaint=OverpaintConfig((path,), continues=True))
                found[f"{name} --continue"] = error_of(scene, config, camera, held_out)
    return found


def _in_picture(points: F64, camera: Camera) -> tuple[F64, F64, F64]:
    """Column and row of the pixel of each point, and its depth."""
    seen = points @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
    places = seen @ camera.K.T
    x, y = (places[:, :2] / places[:, 2:]).T
    limits = camera.width - 1, camera.height - 1
    columns, rows = (np.clip(np.floor(v), 0, m).astype(int) for v, m in zip((x, y), limits, strict=True))
    return columns, rows, seen[:, 2]


def _is_seen(scene: bg.Gaussians, camera: Camera) -> "np.ndarray":
    """[N] whether each lies on the front surface, near the middle of the picture."""
    frame = bg.render(scene, camera, "gaussian")
    assert frame.depth is not None
    x, y, depth = _in_picture(scene.means.astype(np.float64), camera)
    inside = (x > 0) & (y > 0) & (x < camera.width - 1) & (y < camera.height - 1)
    return np.asarray(inside & (np.abs(depth - frame.depth[y, x]) < 0.15))


if __name__ == "__main__":
    names = [name for name in LOOKS if name != "plain"]
    for name, error in errors(12_000, 2500, 360, names, ["oil", "impressionist"]).items():
        print(f"{name:28} {error.direction:5.1f} degrees {error.color:7.3f}")
