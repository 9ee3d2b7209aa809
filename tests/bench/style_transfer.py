"""How an edit that is learnt from one scene does on others: the first table of how styles travel.

    python -m tests.bench.style_transfer [--scenes koala chair truck biker skull still_life]
        [--controls warm grey ...] [--sizes] [--json FILE]

An edit ("control") is made to the Gaussians of a scene, whose colours are then rounded to 8 bits as most
files hold them, and learnt from the scene before and after it. What was learnt is applied to the strokes of
each scene, and compared with a painting of the edited scene, whose strokes are made anew: PSNR over 3 views
of 256x192, pixels that are more than half painted, flat dabs. "Floor" is the control itself on the strokes of
the scene against the same painting: two clusterings differ by so much. "On" are the scenes that it was learnt
from, "off" all pairs of different scenes. "Unchanged" is the PSNR of strokes to which nothing is done: what a
style must beat. --sizes gives the error by the number of bumps, the bytes of the style file, and seconds.
"""

import argparse
import json
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import brushgs as bg
from brushgs.cameras.framing import frame_scene
from brushgs.first_view import find_first_view
from brushgs.formats.styles import write_style
from brushgs.passes.color.color_map import difference_slopes, map_colors
from brushgs.passes.style.edit import apply_edit, needed_features
from brushgs.passes.style.features import StrokeFeatures, stroke_features
from brushgs.passes.style.fit_bumps import COUNTS
from brushgs.passes.style.learn_edit import learn_edit
from brushgs.still_life import still_life
from brushgs.values.arrays import F64
from brushgs.values.camera import FirstView
from brushgs.values.colors import LUMINANCE
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import C0
from brushgs.values.style import Style, StyleEdit
from tests.bench.machine import describe
from tests.scenes import SCENES_FOLDER

SCENES = {
    "koala": ("koala.ply", "-y"),
    "chair": ("derived/chair.ply", "+z"),
    "truck": ("truck.splat", None),
    "biker": ("biker.spz", None),
    "skull": ("skull.sog", None),
}
NUM_STROKES, SIZE, AZIMUTHS = 4000, (256, 192), (0.0, 0.7, -0.7)
DAB = bg.StrokeTexture.open("ellipse")


@dataclass(frozen=True, eq=False)
class Control:
    """An edit whose result is known: a `ColorMap` of colours and, by `feature`, of strokes.

    Attributes:
        of: colours after [n, 3], by colours before and the feature [n].
        feature: that it depends on beside colour.
        is_restoring: from its result back to the scene.
        is_of_base: the base colour is edited, and its change with the direction stays as it is.
    """

    of: Callable[[F64, F64], F64]
    feature: str | None = None
    is_restoring: bool = False
    is_of_base: bool = False

    @property
    def names(self) -> tuple[str, ...]:
        return () if self.feature is None else (self.feature,)

    def colors(self, rgb: F64, features: StrokeFeatures | None = None) -> F64:
        column = np.zeros(len(rgb))
        if self.feature is not None:
            assert features is not None
            column = features.columns((self.feature,))[:, 0]
        return self.of(rgb, column)

    def slopes(self, rgb: F64, after: F64, features: StrokeFeatures | None = None) -> F64:
        if self.is_of_base:
            return np.broadcast_to(np.eye(3), (len(rgb), 3, 3))
        return difference_slopes(self, rgb, features)


def _grey(rgb: F64) -> F64:
    return np.repeat((rgb @ np.array(LUMINANCE))[:, None], 3, axis=1)


def _saturated(factor: float) -> Callable[[F64, F64], F64]:
    return lambda rgb, _: _grey(rgb) + factor * (rgb - _grey(rgb))


def _orange_to_green(rgb: F64, _: F64) -> F64:
    """Hues around orange turn by 90 degrees, with a soft edge; greys stay."""
    axes = np.linalg.qr(np.array([[1.0, 1, 1], [1, -0.5, -0.5], [0, 1, -1]]).T)[0]
    axes *= np.sign(axes[0, 0]), np.sign(axes[0, 1]), np.sign(axes[1, 2])
    grey, x, y = (rgb @ axes).T  # x toward red, y toward green
    hue, chroma = np.arctan2(y, x), np.hypot(x, y)
    away = np.abs(np.angle(np.exp(1j * (hue - np.radians(30)))))
    share = np.clip((np.radians(50) - away) / np.radians(20), 0, 1) * np.clip(chroma / 0.1 - 0.2, 0, 1)
    hue = hue + np.radians(90) * share
    return np.stack([grey, chroma * np.cos(hue), chroma * np.sin(hue)], axis=1) @ axes.T


def _posterised(rgb: F64, _: F64) -> F64:
    """Five levels of each channel, which no affine map and few bumps express."""
    return np.floor(np.clip(rgb, 0, 0.9999) * 5) / 4


CONTROLS = {
    "warm": Control(lambda rgb, _: rgb * (1.12, 1.0, 0.78) + (0.03, 0.01, -0.02)),
    "grey": Control(lambda rgb, _: _grey(rgb)),
    "negative": Control(lambda rgb, _: 1 - rgb),
    "saturation 1.6": Control(_saturated(1.6)),
    "saturation 0.4": Control(_saturated(0.4)),
    "orange to green": Control(_orange_to_green),
    "darker upward": Control(lambda rgb, up: rgb * (1 - 0.7 * np.clip(up, 0, 1))[:, None], "height"),
    "posterised": Control(_posterised, is_of_base=True),
    "colour from grey": Control(lambda rgb, _: _grey(rgb), is_restoring=True),
}


def strokes_of(scene: Gaussians) -> Gaussians:
    return bg.cluster(bg.prune(scene, 0.7), NUM_STROKES)


def in_8_bits(gaussians: Gaussians) -> Gaussians:
    """With colours as a .splat file holds them."""
    rgb = np.clip(0.5 + C0 * gaussians.sh[:, 0].astype(np.float64), 0, 1)
    sh = gaussians.sh.copy()
    sh[:, 0] = (np.round(255 * rgb) / 255 - 0.5) / C0
    return replace(gaussians, sh=sh)


class Case:
    """A scene with its strokes and views."""

    def __init__(self, name: str) -> None:
        self.name = name
        if name == "still_life":
            self.scene: Gaussians = still_life()
            up = "-y"
        else:
            path, up = SCENES[name]
            self.scene = bg.clean(bg.load(SCENES_FOLDER / path))
        self.view: FirstView = find_first_view(self.scene, up=up)
        self.strokes = strokes_of(self.scene)
        width, height = SIZE
        self.cameras = [
            frame_scene(self.view, width=width, height=height, azimuth=self.view.azimuth + turn)
            for turn in (AZIMUTHS if name != "still_life" else (0.0, 0.15, -0.15))
        ]
        self.painted = [bg.render(self.strokes, camera, DAB).alpha > 0.5 for camera in self.cameras]

    def changed(self, control: Control, gaussians: Gaussians) -> Gaussians:
        """Gaussians with the control applied to them."""
        return map_colors(gaussians, control, stroke_features(gaussians, self.view, control.names))

    def states(self, control: Control, gaussians: Gaussians) -> tuple[Gaussians, Gaussians]:
        """Before and after."""
        changed = self.changed(control, gaussians)
        return (changed, gaussians) if control.is_restoring else (gaussians, changed)

    def psnr(self, found: Gaussians, wanted: Gaussians) -> float:
        """Over all views, as a screen shows them."""
        errors = []
        for camera, is_painted in zip(self.cameras, self.painted, strict=True):
            pictures = [np.clip(bg.render(g, camera, DAB).over((1, 1, 1)), 0, 1) for g in (found, wanted)]
            errors.append(((pictures[0] - pictures[1])[is_painted].astype(np.float64) ** 2).reshape(-1))
        return float(-10 * np.log10(max(np.concatenate(errors).mean(), 1e-10)))


@dataclass(frozen=True)
class Row:
    """One control: PSNR [learnt from, applied to], and what it took."""

    control: str
    psnr: list[list[float]]
    unchanged: list[float]
    floor: list[float]
    features: list[str]
    num_bumps: list[int]
    num_bytes: list[int]
    learn_seconds: list[float]
    apply_seconds: list[float]

    def line(self) -> str:
        table = np.array(self.psnr)
        on = np.diag(table)
        off = table[~np.eye(len(table), dtype=bool)]
        cells = [self.control]
        cells += [f"{min(some):.1f} to {max(some):.1f}" for some in (self.unchanged, self.floor)]
        for some in (on, off):
            cells += [f"{some.min():.1f}", f"{np.median(some):.1f}"] if len(some) else ["-", "-"]
        bumps = f"{min(self.num_bumps)} to {max(self.num_bumps)}"
        cells += [bumps, f"{max(self.num_bytes) / 1000:.1f}", f"{max(self.learn_seconds):.1f}"]
        return " | ".join([*cells, f"{max(self.apply_seconds):.2f}"])


HEAD = "control | unchanged | floor | on: least | median | off: least | median | bumps | kB | learn | apply"


def measure(name: str, cases: list[Case], num_bumps: int | None = None) -> Row:
    """Learn a control on each scene, and apply it to each."""
    control = CONTROLS[name]
    states = []  # of each scene: before and after in 8 bits, and the strokes of both
    row = Row(name, [], [], [], [], [], [], [], [])
    for case in cases:
        before, after = case.states(control, case.scene)
        after = in_8_bits(after)
        own = strokes_of(before) if control.is_restoring else case.strokes
        states.append((before, after, own, strokes_of(after)))
        row.unchanged.append(case.psnr(own, states[-1][3]))
        row.floor.append(case.psnr(case.states(control, case.strokes)[1], states[-1][3]))
    for case, (before, after, _, _) in zip(cases, states, strict=True):
        start = time.perf_counter()
        learnt = learn_edit(before, after, case.view, num_bumps=num_bumps)
        row.learn_seconds.append(time.perf_counter() - start)
        edit = learnt.edit
        row.features.append(" ".join(edit.residual.features) if edit.residual else "")
        row.num_bumps.append(len(edit.residual.centers) if edit.residual else 0)
        row.num_bytes.append(file_size(edit))
        found = []
        for other, (_, _, own, wanted) in zip(cases, states, strict=True):
            start = time.perf_counter()
            features = stroke_features(own, other.view, needed_features([edit]))
            styled = apply_edit(own, edit, features)
            row.apply_seconds.append(time.perf_counter() - start)
            found.append(other.psnr(styled, wanted))
        row.psnr.append(found)
        words = " ".join(f"{p:5.1f}" for p in found)
        print(
            f"  {name}: from {case.name:10} {words}  {row.num_bumps[-1]} bumps {row.features[-1]} "
            f"({learnt.left:.4f} {learnt.held_out:.4f}) {row.learn_seconds[-1]:.1f} s",
            file=sys.stderr,
            flush=True,
        )
    return row


def file_size(edit: StyleEdit) -> int:
    """Bytes of the style file."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "edit.style"
        write_style(Style("edit", edit=edit), path)
        return path.stat().st_size


def main() -> None:
    """As the docstring of the module says."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--scenes", nargs="+", default=None)
    parser.add_argument("--controls", nargs="+", default=list(CONTROLS))
    parser.add_argument("--sizes", action="store_true")
    parser.add_argument("--json", type=Path)
    args = parser.parse_args()
    print(describe() + "\n")
    here = [name for name, (path, _) in SCENES.items() if (SCENES_FOLDER / path).exists()]
    cases = [Case(name) for name in args.scenes or [*here, "still_life"]]
    rows = []
    for name in args.controls:
        for bumps in (0, *COUNTS) if args.sizes else (None,):
            rows.append(measure(name, cases, bumps))
    print(HEAD + "\n" + "-|" * HEAD.count("|") + "-")
    for row in rows:
        print(row.line())
    for row in rows:
        print(f"\n{row.control}, {', '.join(f'{p:.1f}' for p in row.unchanged)} unchanged")
        print(f"floor {', '.join(f'{p:.1f}' for p in row.floor)}\n")
        print(" | ".join(["learnt from", *(case.name for case in cases)]) + "\n" + "-|" * len(cases) + "-")
        for case, found in zip(cases, row.psnr, strict=True):
            print(" | ".join([case.name, *(f"{p:.1f}" for p in found)]))
    if args.json is not None:
        args.json.write_text(json.dumps([row.__dict__ for row in rows], indent=1))


if __name__ == "__main__":
    main()
