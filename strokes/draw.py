"""Draws the built-in stroke images: `python strokes/draw.py [name ...]` writes strokes/<name>.png.

RGBA, straight alpha: alpha is the coverage, RGB the relief as grey with 0.5 the level of the canvas. Each
stroke runs from left to right and has its own fixed seed, so a second run writes the same picture.
The model of brush, paint and canvas is in `bristles.py`.
"""

import sys
from pathlib import Path

import numpy as np
import OpenImageIO
from bristles import (
    WIDTH,
    Brush,
    canvas,
    down,
    finish,
    grain,
    lay,
    noise,
    over,
    round_head,
    segment,
    sheet,
    smoothstep,
    straight,
)
from scipy.ndimage import gaussian_filter1d


def flat(rng):
    """The all-round brush: even, ragged where it lifts."""
    brush = Brush(load_spread=0.5, start=0.04, round_start=0.04, end=0.09, round_end=0.04, load=1.05)
    s, t = straight(96)
    return finish(rng, lay(sheet(rng, brush), s, t * (1.02 + 0.012 * noise(rng, t.shape, (60, 90)))))


def filbert(rng):
    """A rounded toe that lands broad and leaves on a narrow tail."""

    def shape(s):
        """Half width along the stroke."""
        return 0.45 + 0.55 * round_head(s, 0.3) - 0.55 * smoothstep(0.5, 1.0, s)

    brush = Brush(load_spread=0.5, start=0.02, end=0.05, round_start=0.12, round_end=0.08, pile=0.3)
    return finish(rng, lay(sheet(rng, brush), *straight(100, shape, bow=0.03)))


def dry_brush(rng):
    """Little paint on a stiff brush: the weave of the canvas shows, more so towards the end."""
    brush = Brush(
        num_bristles=150,
        bristle=0.011,
        load=1.0,
        load_spread=0.4,
        runs_dry=(0.5, 1.4),
        fade=0.9,
        end=0.06,
        start=0.025,
        pile=0.05,
        bead=0.25,
        clumping=0.9,
        wobble=0.008,
    )
    return finish(rng, lay(sheet(rng, brush), *straight(104)), dryness=0.9, floor=0.02)


def swirl(rng):
    """One brush turned clockwise from the outside to the middle."""
    brush = Brush(
        num_bristles=64,
        bristle=0.026,
        load=1.15,
        load_spread=0.3,
        start=0.012,
        end=0.02,
        round_start=0.02,
        runs_dry=(1.1, 1.9),
        pile=0.5,
        bead=0.15,
        wobble=0.03,
    )
    strip = sheet(rng, brush)
    x, y = canvas(256)
    radius, angle = np.hypot(x - 0.5, y - 0.5), np.arctan2(0.5 - y, 0.5 - x) % (2 * np.pi)
    turns = 2.25
    sway = 0.05 * gaussian_filter1d(rng.standard_normal(3000), 150)
    thickness = np.zeros(radius.shape)
    for winding in range(3):  # clockwise from the left, over the top, towards the middle
        s = (angle / (2 * np.pi) + winding) / turns
        u = np.clip(s, 0, 1)
        half = 0.118 * (0.6 + 0.4 * round_head(u, 0.08)) * (1 - 0.5 * smoothstep(0.5, 1.0, u))
        track = 0.372 - 0.34 * np.clip((u - 0.16) / 0.84, 0, 1) + np.interp(u, np.linspace(0, 1, 3000), sway)
        thickness = over(lay(strip, s, (radius - track) / half), thickness)
    return finish(rng, thickness)


def moon(rng):
    """A crescent over the top, thin where it lands and where it lifts."""
    strip = sheet(rng, Brush(start=0.015, end=0.02, pile=0.35, bead=0.1, load=1.05))
    x, y = canvas(132)
    x, y = x - 0.5, 0.565 - y
    s = (np.pi - np.arctan2(y, x)) / np.pi * 1.04 - 0.02
    half = 0.165 * np.sin(np.pi * np.clip(s, 0.0, 1.0)) ** 0.85 + 0.004
    track = 0.48 - 0.75 * half
    return finish(rng, lay(strip, s, (track - np.hypot(x, 0.94 * y)) / half))


def flower(rng):
    """Five petals, each drawn from its tip to the heart, and a touch in the middle."""

    def petal(s):
        """Half width: broad near the tip, next to nothing at the heart."""
        return 0.5 + 0.5 * round_head(s, 0.35) - 0.88 * smoothstep(0.3, 1.02, s)

    thickness = np.zeros(canvas(256)[0].shape)
    first = rng.uniform(0, 2 * np.pi)
    brush = Brush(
        num_bristles=70,
        bristle=0.026,
        start=0.03,
        round_start=0.16,
        end=0.04,
        runs_dry=(0.9, 1.5),
        pile=0.4,
        bead=0.3,
        load=1.05,
    )
    for k in (0, 3, 1, 4, 2):
        angle = first + 2 * np.pi * k / 5 + rng.normal(0, 0.06)
        ray = np.array([np.cos(angle), np.sin(angle)])
        half = 0.225 * rng.uniform(0.92, 1.06)
        way = segment(256, 0.5 + 0.49 * ray, 0.5 + 0.01 * ray, half, petal)
        thickness = over(lay(sheet(rng, brush), *way), thickness)
    heart = Brush(
        num_bristles=24,
        bristle=0.06,
        start=0.1,
        end=0.14,
        round_start=0.4,
        round_end=0.4,
        pile=0.3,
        wobble=0.1,
        load=1.2,
    )
    return finish(
        rng, over(lay(sheet(rng, heart), *segment(256, (0.41, 0.52), (0.58, 0.48), 0.075)), thickness)
    )


def x(rng):
    """Two flat strokes crossed, the rising one on top."""
    brush = Brush(
        num_bristles=84, bristle=0.021, load_spread=0.3, start=0.02, end=0.05, runs_dry=(0.8, 1.5), pile=0.4
    )
    down_right = lay(sheet(rng, brush), *segment(256, (0.12, 0.13), (0.89, 0.87), 0.17))
    up_right = lay(sheet(rng, brush), *segment(256, (0.11, 0.88), (0.88, 0.12), 0.17))
    return finish(rng, over(up_right, down_right))


def dab(rng):
    """Pressed down with plenty of paint, hardly moved, lifted."""

    def shape(s):
        """Half width along the stroke."""
        return 0.7 + 0.3 * round_head(s, 0.45) - 0.16 * smoothstep(0.5, 1, s)

    brush = Brush(
        num_bristles=120,
        bristle=0.017,
        start=0.03,
        end=0.09,
        round_start=0.24,
        round_end=0.2,
        pile=0.55,
        bead=0.5,
        load=1.1,
        load_spread=0.45,
        runs_dry=(0.85, 1.4),
        wobble=0.016,
    )
    return finish(rng, lay(sheet(rng, brush), *straight(168, shape, bow=0.03)))


def fan(rng):
    """A fan brush: tufts that spread apart."""
    brush = Brush(
        num_bristles=46,
        bristle=0.016,
        load=0.85,
        load_spread=0.45,
        runs_dry=(0.7, 1.5),
        fade=0.6,
        start=0.02,
        end=0.09,
        round_end=0.12,
        pile=0.0,
        bead=0.5,
        clumping=0.8,
        wobble=0.006,
    )
    way = straight(150, lambda s: 0.4 + 0.6 * s)
    return finish(rng, lay(sheet(rng, brush), *way), dryness=0.35, floor=0.04)


def impasto(rng):
    """Paste laid on thick: few, heavy ridges."""
    brush = Brush(
        num_bristles=44,
        bristle=0.03,
        load=1.6,
        load_spread=0.42,
        runs_dry=(1.2, 2.0),
        start=0.03,
        end=0.07,
        round_start=0.05,
        round_end=0.05,
        pile=1.0,
        bead=1.0,
        wobble=0.022,
        clumping=0.9,
    )
    s, t = straight(116)
    t = t * (1.03 + 0.025 * noise(rng, t.shape, (24, 30))) + 0.008 * noise(rng, t.shape, (14, 40))
    return finish(rng, lay(sheet(rng, brush), s, t), dryness=0.15, relief=0.55)


def ink(rng):
    """A loaded round brush on absorbent paper: pressed, drawn out, lifted; pooled rim, feathered edge."""
    x, y = canvas(96)
    shape = x.shape
    s = (x - 0.02) / 0.96
    u = np.clip(s, 0, 1)
    half = 0.168 * round_head(u + 0.12 * (y - 0.1), 0.13) * (1 - 0.55 * smoothstep(0.2, 1.0, u))
    middle = 0.187 + 0.022 * np.sin(2.8 * u + 0.3) - 0.012
    fibres = (
        0.0016 * noise(rng, shape, (3, 9)) + 0.0022 * noise(rng, shape, 14) + 0.003 * noise(rng, shape, 60)
    )
    inside = half - np.abs(y - middle) + fibres - 0.004  # distance to the edge, picture widths
    bleed = 0.0035 * np.exp(0.8 * noise(rng, shape, 40))
    touch = smoothstep(-bleed, bleed * 0.6, inside) * (s > 0)
    hairs = Brush(
        num_bristles=70,
        bristle=0.018,
        load=1.2,
        load_spread=0.5,
        runs_dry=(0.62, 1.12),
        fade=0.2,
        end=0.05,
        start=0.0,
    )
    streaks = lay(sheet(rng, hairs), s, (y - middle) / np.maximum(half, 1e-3) * 0.96)
    dry = smoothstep(0.3, 0.95, u)
    wet = 1 - dry * (1 - smoothstep(0.1, 0.45, streaks - 0.25 * dry * (0.5 + grain(rng, shape))))
    rim = np.exp(-0.5 * ((inside - 0.008) / 0.006) ** 2) * (1 - dry)
    pool = smoothstep(0.35, 0.0, u) + 0.35 * noise(rng, shape, (30, 70))
    wash = 0.87 + 0.05 * pool + 0.12 * rim + 0.012 * noise(rng, shape, 2.5)
    level = 0.52 + 0.1 * rim + 0.03 * pool
    return down(level, (touch * wash * wet).clip(0, 1))


def palette_knife(rng):
    """Paste spread with a blade: hard edged, ridges where it was squeezed out, torn where it ran thin."""
    x, y = canvas(104)
    shape = x.shape
    s = (x - 0.02 - 0.05 * (y - 0.2)) / 0.955
    wander = 0.0012 * noise(rng, shape, (4, 30)) + 0.003 * noise(rng, shape, (4, 140))
    side = np.minimum(y - 0.026 - 0.018 * x + wander, 0.386 - 0.006 * x - y - wander)  # distance to the sides
    front = s + 0.0016 * noise(rng, shape, 5)
    scrape = (
        0.5 * noise(rng, shape, (1.6, 320))
        + 0.6 * noise(rng, shape, (12, 420))
        + 0.3 * noise(rng, shape, (40, 130))
    )
    film = 1.05 + 0.2 * scrape - 0.3 * smoothstep(0.4, 1.0, s)
    tear = 0.5 * noise(rng, shape, (10, 70)) + 0.35 * noise(rng, shape, (3.5, 16)) + 0.35 * scrape
    stays = smoothstep(0.0, 0.14, 2.6 * smoothstep(1.02, 0.5, s) - 0.55 + tear)
    stays = (
        stays
        * smoothstep(1.0, 0.97, s + 0.02 * tear)
        * smoothstep(-1.9, -1.75, tear + 0.3 * noise(rng, shape, (3, 5)))
    )
    ridge = np.exp(-0.5 * ((side - 0.009) / 0.007) ** 2) * (1 + 0.6 * noise(rng, shape, (16, 50)))
    bead = np.exp(-0.5 * ((s - 0.014) / 0.013) ** 2) * (1 + 0.6 * noise(rng, shape, (50, 16)))
    hard = smoothstep(-0.0015, 0.002, np.minimum(side, front))
    paste = (film + 0.9 * (ridge + bead).clip(0)) * hard * stays
    return finish(rng, paste.clip(0), dryness=0.12, soft=0.15, opacity=2.6, relief=0.55)


def splatter(rng):
    """Thin paint flicked from the left: one wet blot, and drops that fly on to the right with tails."""
    x, y = canvas(200)
    field = np.zeros(x.shape)

    def drop(center, radius, stretch=1.0, angle=0.0):
        """One drop: a bump that is 1 on the drop's edge and adds up, so that near drops flow together."""
        u = np.cos(angle) * (x - center[0]) + np.sin(angle) * (y - center[1])
        v = -np.sin(angle) * (x - center[0]) + np.cos(angle) * (y - center[1])
        taper = 1 + 0.55 * np.clip(u / (radius * stretch), -1, 1) if stretch > 1.2 else 1
        reach = (u / stretch) ** 2 + (v / taper) ** 2
        return (np.clip(1 - reach / (2.6 * radius**2), 0, 1) / (1 - 1 / 2.6)) ** 2

    origin = np.array([0.45, 0.39])
    for _ in range(34):
        angle, distance = rng.uniform(-np.pi, np.pi), 0.235 * np.sqrt(rng.random())
        field += drop(
            origin + distance * np.array([1.25 * np.cos(angle), np.sin(angle)]), rng.uniform(0.05, 0.09)
        )
    for kind in 36 * ["tail"] + 150 * ["drop"]:
        angle = rng.normal(0, 0.85) + (np.pi if rng.random() < 0.25 else 0)
        if kind == "tail":
            reach, size, stretch = (
                0.24 + 0.16 * rng.random(),
                0.006 + 0.017 * rng.random() ** 2,
                rng.uniform(2.5, 6),
            )
        else:
            reach, size, stretch = (
                0.26 + rng.gamma(2.0, 0.05),
                0.0025 + 0.017 * rng.random() ** 4,
                rng.uniform(1, 2.2),
            )
        center = origin + reach * np.array([np.cos(angle), 0.82 * np.sin(angle)])
        margin = 1.6 * size * stretch + 0.005
        if margin < center[0] < 1 - margin and margin < center[1] < 200 / WIDTH - margin:
            field += drop(center, size, stretch, angle)
    touch = smoothstep(0.9, 1.15, field + 0.02 * noise(rng, x.shape, 4))
    thin = (
        0.9
        + 0.1 * smoothstep(1.0, 2.2, field)
        - 0.14 * smoothstep(1.6, 6, field) * (1 + 0.5 * noise(rng, x.shape, 50))
    )
    rim = np.exp(-0.5 * ((field - 1.5) / 0.35) ** 2)
    level = 0.55 + 0.1 * smoothstep(1, 2.5, field) + 0.08 * rim
    return down(level, (touch * thin).clip(0, 1))


def charcoal(rng):
    """The side of a stick on rough paper: the tooth stays white where the pressure is low."""
    x, y = canvas(100)
    shape = x.shape
    s, t = (x - 0.012) / 0.976, (y / (100 / WIDTH) - 0.5) / 0.47
    t = t + 0.02 * noise(rng, shape, (20, 90))
    tooth = 0.6 * noise(rng, shape, 3.2) + 0.5 * noise(rng, shape, 1.7) + 0.3 * noise(rng, shape, (3, 9))
    drag = noise(rng, shape, (3, 240)) * 0.28 + noise(rng, shape, (14, 300)) * 0.3
    press = (
        1.25
        - 0.75 * smoothstep(0.25, 1.0, s)
        + 0.35 * smoothstep(0.5, -1.0, t)
        + 0.25 * noise(rng, shape, (60, 120))
    )
    edge = smoothstep(1.02, 0.86, np.abs(t)) * smoothstep(0, 0.03, s) * smoothstep(1.0, 0.9, s)
    grip = press + 0.75 * tooth + drag - 2.6 * (1 - edge)
    coverage = smoothstep(0.05, 0.75, grip) * (0.72 + 0.24 * smoothstep(0.4, 2.2, grip))
    return down(0.5 + 0.12 * coverage + 0.02 * tooth, coverage)


STROKES = {
    stroke.__name__: stroke
    for stroke in (
        flat,
        filbert,
        dab,
        impasto,
        dry_brush,
        fan,
        swirl,
        moon,
        flower,
        x,
        ink,
        palette_knife,
        splatter,
        charcoal,
    )
}


def draw(name):
    """The stroke called `name`, float [h, w, 4] RGBA from 0 to 1, straight alpha."""
    return STROKES[name](np.random.default_rng([20, *name.encode()]))


def write(name, folder):
    """Draw `name` and write it into `folder` as 8-bit PNG."""
    pixels = np.ascontiguousarray(np.rint(draw(name) * 255).astype(np.uint8))
    path = Path(folder) / f"{name}.png"
    spec = OpenImageIO.ImageSpec(pixels.shape[1], pixels.shape[0], 4, OpenImageIO.UINT8)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.attribute("png:compressionLevel", 9)
    out = OpenImageIO.ImageOutput.create(str(path))
    if not (out and out.open(str(path), spec) and out.write_image(pixels) and out.close()):
        raise OSError(f"{path}: cannot be written ({OpenImageIO.geterror()}); check the folder")
    return path


if __name__ == "__main__":
    for stroke in sys.argv[1:] or STROKES:
        print(write(stroke, Path(__file__).resolve().parent))
