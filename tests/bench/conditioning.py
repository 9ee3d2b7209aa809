"""Error against conditioning: aspect ratio, distance and size, for boxes and pictures in float32 and float64.

    python -m tests.bench.conditioning [--output examples/measured]

Writes conditioning.png and the tables of conditioning.md, between its two marks. Seconds.

Boxes are compared with extended precision on the same input (`tests/stiff/precise.py`), the low-pass left
out: it would hide what it is about. The error of a box is the worst of both extents (relative) and the
angle (radians, times the anisotropy). Two yardsticks do the same wholly in float32: "factor" with |w^T M|,
as brushgs, and "covariance" with mid +- sqrt(mid^2 - det) of M M^T, as is common. Pictures are plain
renders (3 sigma) with the usual low-pass, float32 against float64 on the same float32 scene: root of the
mean square over the picture, of 1.
"""

import argparse
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from brushgs.brushes.texture import StrokeTexture
from brushgs.formats.files import replacing
from brushgs.rendering import reference
from brushgs.rendering.project import project
from brushgs.rendering.render import render
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians
from tests.bench.machine import describe
from tests.stiff.precise import HAS_DIGITS, Exact, errors_of, exact

N = 400
PROMISE = 1e-4
SIZE = {"width": 160, "height": 120}
FOCAL = 800.0  # pixels: of the boxes; pictures see the same view smaller
EYE = np.array((1.0, 1.0, 1.0))
AXES = {
    "aspect ratio of the Gaussian": np.logspace(0, 8, 17),
    "distance, world units": np.logspace(-6, 6, 25),
    "size, world units": np.logspace(-8, 6, 29),
}
SERIES = {  # name: colour (Okabe and Ito 2008), dashes
    "covariance, float32 throughout": ("#D55E00", "-"),
    "factor, float32 throughout": ("#E69F00", "-"),
    "brushgs, float32 scene": ("#0072B2", "-"),
    "brushgs, float64 scene": ("#009E73", "-"),
    "picture, float32 scene": ("#777777", "--"),
}
F32 = NDArray[np.float32]


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--output", type=Path, default=Path("examples/measured"))
    output = parser.parse_args().output
    if not HAS_DIGITS:
        raise SystemExit(
            "conditioning: longdouble is no longer than double here, so nothing can be compared with it"
        )
    errors = {axis: {float(x): measure(axis, float(x)) for x in values} for axis, values in AXES.items()}
    draw(errors, output / "conditioning.png")
    write_tables(errors, output / "conditioning.md")


def measure(axis: str, x: float) -> dict[str, float]:
    """The error of every series at one point of an axis."""
    scene, camera = workload(axis, x)
    wide = scene.astype(np.float64)
    wanted = exact(scene, camera, low_pass=0.0)
    boxes = project(scene, camera, low_pass=0.0)
    covariance, factor = naive(scene, camera)
    small = camera.resized(SIZE["width"], SIZE["height"])
    plain = StrokeTexture.open("gaussian")
    pictures = [render(some, small, plain).rgb.astype(np.float64) for some in (scene, wide)]
    return {
        "covariance, float32 throughout": worst(*covariance, boxes.ids, wanted),
        "factor, float32 throughout": worst(*factor, boxes.ids, wanted),
        "brushgs, float32 scene": of_boxes(boxes, wanted),
        "brushgs, float64 scene": of_boxes(project(wide, camera, low_pass=0.0), wanted),
        "picture, float32 scene": float(np.sqrt(((pictures[0] - pictures[1]) ** 2).mean())),
    }


def workload(axis: str, x: float) -> tuple[Gaussians, Camera]:
    """Needles in all directions before a camera that stands away from the origin, as cameras do."""
    g = np.random.default_rng(20250612)
    distance = x if axis.startswith("distance") else 3.0
    aspect = x if axis.startswith("aspect") else 10.0
    size = x if axis.startswith("size") else 0.1 * distance
    camera = Camera.look_at(
        EYE,
        EYE + np.array((0.3, -0.2, 1.0)),
        width=800,
        height=600,
        fov_y=2 * np.arctan(300 / FOCAL),
        near=1e-9,
    )
    seen = np.stack([g.uniform(-0.4, 0.4, N), g.uniform(-0.3, 0.3, N), g.uniform(0.7, 1.4, N)], axis=1)
    scales = size * np.stack([np.ones(N), *(np.exp(g.uniform(0, 1, (2, N))) / aspect)], axis=1)
    columns = (
        EYE + distance * seen @ camera.viewmat[:3, :3],
        g.normal(size=(N, 4)),
        scales,
        g.uniform(0.1, 0.9, N),
        g.normal(size=(N, 1, 3)),
    )
    return Gaussians(*(column.astype(np.float32) for column in columns)), camera


def naive(scene: Gaussians, camera: Camera) -> tuple[tuple[F32, F32], tuple[F32, F32]]:
    """Half extents [N, 2] and angles [N] in float32 throughout: by the covariance, and by the factor."""
    f = np.float32
    W, shift = camera.viewmat[:3, :3].astype(f), camera.viewmat[:3, 3].astype(f)
    t = scene.means @ W.T + shift
    with np.errstate(all="ignore"):
        J = reference.jacobian(t, camera).astype(f)
        M = J @ W @ reference.rotation_matrices(scene.quats).astype(f) * scene.scales[:, None]
        cov = M @ M.transpose(0, 2, 1)
        a, b, c = cov[:, 0, 0], cov[:, 0, 1], cov[:, 1, 1]
        angles = f(0.5) * np.arctan2(2 * b, a - c)
        mid, det = f(0.5) * (a + c), a * c - b * b
        root = np.sqrt(np.maximum(mid * mid - det, f(0)))
        by_covariance = 2 * np.sqrt(np.maximum(np.stack([mid + root, mid - root], axis=1), f(0)))
        u = np.stack([np.cos(angles), np.sin(angles)], axis=1)
        v = np.stack([-u[:, 1], u[:, 0]], axis=1)
        by_factor = 2 * np.sqrt(np.stack([((w[:, None] @ M) ** 2).sum(axis=(1, 2)) for w in (u, v)], axis=1))
    return (by_covariance, angles), (by_factor, angles)


def of_boxes(boxes: object, wanted: Exact) -> float:
    errors = errors_of(boxes, wanted)
    return max(errors.length, errors.width, errors.angle)


def worst(half_extents: F32, angles: F32, ids: NDArray[np.int32], wanted: Exact) -> float:
    """The measure of `errors_of`, for columns by row; what is not finite counts as wholly wrong."""
    expected = wanted.half_extents[ids]
    ratio = np.abs(half_extents[ids] / expected - 1).astype(float)
    turn = (angles[ids] - wanted.angles[ids]) / np.pi
    anisotropy = 1 - 2 / (1 + (expected[:, 0] / expected[:, 1]) ** 2)
    turn = (np.abs(turn - np.round(turn)) * np.pi * anisotropy).astype(float)
    return float(np.nan_to_num(np.concatenate([ratio.ravel(), turn]), nan=1.0, posinf=1.0).max())


Errors = dict[str, dict[float, dict[str, float]]]


def draw(errors: Errors, path: Path) -> None:
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.0, 3.6), dpi=90, layout="constrained")
    FigureCanvasAgg(figure)
    panels = figure.subplots(1, 3, sharey=True)
    for panel, (axis, points) in zip(panels, errors.items(), strict=True):
        for name, (color, dashes) in SERIES.items():
            values = [max(point[name], 1e-17) for point in points.values()]
            panel.loglog(list(points), values, dashes, color=color, linewidth=1.6, label=name)
        panel.axhline(PROMISE, color="black", linewidth=0.8, linestyle=":")
        panel.set_xlabel(axis, fontsize=9)
        panel.tick_params(labelsize=8)
        panel.grid(alpha=0.25)
    panels[0].set_ylabel("worst error (picture: RMSE)", fontsize=9)
    panels[0].set_ylim(1e-17, 3)
    panels[2].text(1e-8, 1.5 * PROMISE, "promised: 1e-4", fontsize=8)
    handles, labels = panels[0].get_legend_handles_labels()
    figure.legend(handles, labels, loc="outside upper center", ncols=3, fontsize=8, frameon=False)
    with replacing(path) as temporary:
        figure.savefig(temporary, format="png", metadata={"Software": None})


BEGIN, END = "<!-- tables: python -m tests.bench.conditioning -->\n", "<!-- end of tables -->\n"
SHOWN = {
    "aspect ratio of the Gaussian": (1, 1e1, 1e2, 1e3, 1e4, 1e5, 1e6, 1e8),
    "distance, world units": (1e-6, 1e-4, 1e-2, 1, 1e2, 1e4, 1e6),
    "size, world units": (1e-8, 1e-4, 1e-2, 1, 1e2, 1e4, 1e6),
}


def write_tables(errors: Errors, path: Path) -> None:
    """Replace what stands between the marks of the page."""
    lines = [f"{describe()}.\n"]
    for axis, points in errors.items():
        lines += [f"\n| {axis} | " + " | ".join(SERIES) + " |\n", "|---" * (len(SERIES) + 1) + "|\n"]
        for x in SHOWN[axis]:
            point = points[min(points, key=lambda other: abs(np.log(other / x)))]
            lines.append(f"| {x:.0e} | " + " | ".join(f"{point[name]:.0e}" for name in SERIES) + " |\n")
    tables = "".join(lines)
    print(tables)
    page = path.read_text(encoding="utf-8")
    before, rest = page.split(BEGIN)
    path.write_text(before + BEGIN + "\n" + tables + "\n" + END + rest.split(END)[1], encoding="utf-8")


if __name__ == "__main__":
    main()
