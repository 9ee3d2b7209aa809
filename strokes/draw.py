"""Draws the built-in stroke images: `python strokes/draw.py [name ...]` writes strokes/<name>.png.

RGBA, straight alpha: alpha is the coverage, RGB the relief as grey with 0.5 the level of the canvas. Each
stroke runs from left to right and has its own fixed seed, so a second run writes the same picture.
The model of brush, paint and canvas is in `bristles.py`.

Painterly brushes have variants (`flat_2.png`), so that strokes side by side differ: the same brush with other
bristles, another bow and another way of lifting. Each function takes the number of the variant, 0 for the
first.
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
from scipy.ndimage import distance_transform_edt, gaussian_filter1d, label


def flat(rng, k=0):
    """The all-round brush: even, ragged where it lifts."""
    brush = Brush(
        load_spread=(0.5, 0.45, 0.6, 0.5)[k],
        start=0.04,
        round_start=(0.04, 0.02, 0.05, 0.03)[k],
        end=(0.09, 0.14, 0.07, 0.2)[k],
        round_end=(0.04, 0.02, 0.1, 0.05)[k],
        load=(1.05, 1.15, 1.0, 1.05)[k],
        runs_dry=((0.9, 1.6), (1.1, 1.8), (0.8, 1.4), (0.75, 1.5))[k],
    )
    s, t = straight(96, bow=(0, 0.018, -0.022, 0.01)[k], slant=(0, 0.022, -0.012, -0.03)[k])
    return finish(rng, lay(sheet(rng, brush), s, t * (1.02 + 0.012 * noise(rng, t.shape, (60, 90)))))


def filbert(rng, k=0):
    """A rounded toe that lands broad and leaves on a narrow tail."""

    def shape(s):
        """Half width along the stroke."""
        tail, begins = (0.55, 0.45, 0.6, 0.35)[k], (0.5, 0.35, 0.6, 0.45)[k]
        return 0.45 + 0.55 * round_head(s, (0.3, 0.36, 0.24, 0.3)[k]) - tail * smoothstep(begins, 1.0, s)

    brush = Brush(load_spread=0.5, start=0.02, end=0.05, round_start=0.12, round_end=0.08, pile=0.3)
    way = straight(100, shape, bow=(0.03, -0.028, 0.05, 0.0)[k], slant=(0, 0.01, 0.02, -0.015)[k])
    return finish(rng, lay(sheet(rng, brush), *way))


def dry_brush(rng, k=0):
    """Little paint on a stiff brush: the weave of the canvas shows, more so towards the end."""
    brush = Brush(
        num_bristles=150,
        bristle=0.011,
        load=1.0,
        load_spread=0.4,
        runs_dry=((0.5, 1.4), (0.6, 1.6), (0.4, 1.2))[k],
        fade=0.9,
        end=0.06,
        start=0.025,
        pile=0.05,
        bead=0.25,
        clumping=0.9,
        wobble=0.008,
    )
    way = straight(104, bow=(0, 0.02, -0.025)[k], slant=(0, -0.02, 0.03)[k])
    return finish(rng, lay(sheet(rng, brush), *way), dryness=0.9, floor=0.02)


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


def dab(rng, k=0):
    """Pressed down with plenty of paint, hardly moved, lifted."""

    def shape(s):
        """Half width along the stroke."""
        less = (0.16, 0.05, 0.26, 0.12)[k]
        return 0.7 + 0.3 * round_head(s, (0.45, 0.5, 0.35, 0.6)[k]) - less * smoothstep(0.5, 1, s)

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
    return finish(
        rng,
        lay(
            sheet(rng, brush),
            *straight(168, shape, bow=(0.03, -0.04, 0.05, 0.01)[k], slant=(0, 0.03, -0.04, 0.06)[k]),
        ),
    )


def fan(rng, k=0):
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
    way = straight(150, lambda s: 0.4 + 0.6 * s, bow=(0, 0.04)[k], slant=(0, 0.02)[k])
    return finish(rng, lay(sheet(rng, brush), *way), dryness=0.35, floor=0.04)


def impasto(rng, k=0):
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
    s, t = straight(116, bow=(0, -0.03, 0.025)[k], slant=(0, 0.03, -0.025)[k])
    t = t * (1.03 + 0.025 * noise(rng, t.shape, (24, 30))) + 0.008 * noise(rng, t.shape, (14, 40))
    return finish(rng, lay(sheet(rng, brush), s, t), dryness=0.15, relief=0.55)


def ink(rng, k=0):
    """A loaded round brush on absorbent paper: pressed, drawn out, lifted; pooled rim, feathered edge."""
    x, y = canvas(96)
    shape = x.shape
    s = (x - 0.02) / 0.96
    u = np.clip(s, 0, 1)
    half = 0.168 * round_head(u + 0.12 * (y - 0.1), 0.13) * (1 - 0.55 * smoothstep(0.2, 1.0, u))
    middle = 0.187 + (0.022, -0.02, 0.016)[k] * np.sin((2.8, 3.0, 5.2)[k] * u + 0.3) - (0.012, -0.008, 0)[k]
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
        runs_dry=((0.62, 1.12), (0.75, 1.3), (0.5, 1.1))[k],
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
    return level, (touch * wash * wet).clip(0, 1)


def palette_knife(rng, k=0):
    """Paste spread with a blade: hard edged, ridges where it was squeezed out, torn where it ran thin."""
    x, y = canvas(104)
    shape = x.shape
    s = (x - 0.02 - (0.05, -0.08, 0.11)[k] * (y - (0.2, 0.2, 0.1)[k])) / 0.955
    wander = 0.0012 * noise(rng, shape, (4, 30)) + 0.003 * noise(rng, shape, (4, 140))
    side = np.minimum(
        y - 0.026 - (0.018, 0.002, 0.03)[k] * x + wander, 0.386 - (0.006, 0.03, 0.0)[k] * x - y - wander
    )  # distance to the sides
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
    return level, (touch * thin).clip(0, 1)


def charcoal(rng, k=0):
    """The side of a stick on rough paper: the tooth stays white where the pressure is low."""
    x, y = canvas(100)
    shape = x.shape
    s, t = (x - 0.012) / 0.976, (y / (100 / WIDTH) - 0.5) / (0.47, 0.43, 0.43, 0.45)[k]
    t = t + 0.02 * noise(rng, shape, (20, 90)) + (0, 0.1, -0.12, 0.05)[k] * (4 * (s - 0.5) ** 2 - 0.5)
    tooth = 0.6 * noise(rng, shape, 3.2) + 0.5 * noise(rng, shape, 1.7) + 0.3 * noise(rng, shape, (3, 9))
    drag = noise(rng, shape, (3, 240)) * 0.28 + noise(rng, shape, (14, 300)) * 0.3
    press = (
        1.25
        - (0.75, 0.4, 0.9, 0.6)[k] * smoothstep(0.25, 1.0, s)
        + 0.35 * smoothstep(0.5, -1.0, t if k % 2 == 0 else -t)
        + 0.25 * noise(rng, shape, (60, 120))
    )
    edge = smoothstep(1.02, 0.86, np.abs(t)) * smoothstep(0, 0.03, s) * smoothstep(1.0, 0.9, s)
    grip = press + 0.75 * tooth + drag - 2.6 * (1 - edge)
    coverage = smoothstep(0.05, 0.75, grip) * (0.72 + 0.24 * smoothstep(0.4, 2.2, grip))
    if k:  # no grains at the border of the picture
        coverage *= smoothstep(1.12, 1.0, np.abs(t)) * smoothstep(0.52, 0.5, np.abs(s - 0.5))
    return 0.5 + 0.12 * coverage + 0.02 * tooth, coverage


def wash(rng, k=0):
    """A touch of watercolour: even and thin, darker where it dried at its rim, of a ragged outline."""
    x, y = canvas((164, 148, 176, 120)[k])
    shape = x.shape
    height = shape[0] / shape[1]
    u, v = (x - 0.5) / 0.42, (y - height / 2) / (height / 2 - 0.055)
    v = v + (0.1, -0.14, 0.05, 0.16)[k] * (u * u - 0.4)
    lobes = 0.1 * noise(rng, shape, 120) + 0.05 * noise(rng, shape, 42) + 0.008 * noise(rng, shape, 12)
    far = (np.abs(u) ** 2.6 + np.abs(v) ** 2.6) ** (1 / 2.6) + lobes.clip(-0.25, 0.12)
    parts, _ = label(far < 0.9)
    wet = parts == parts[shape[0] // 2, shape[1] // 2]  # without drops beside it
    # The tooth of the paper, which the water meets.
    teeth = 0.0012 * noise(rng, shape, 4) + 0.0007 * noise(rng, shape, 1.5)
    inside = distance_transform_edt(wet) / shape[1] - distance_transform_edt(~wet) / shape[1] + teeth
    touch = smoothstep(-0.0016, 0.002, inside)
    skip = noise(rng, shape, (2.2, 7)) + 0.8 * noise(rng, shape, 30) + 1.6 * u  # dry where it was lifted
    touch = touch * (1 - 0.85 * smoothstep(2.6, 3.2, skip) * smoothstep(0.04, 0.004, inside))
    rim = np.exp(-0.5 * ((inside - 0.005) / 0.0055) ** 2) * (1 + 0.35 * noise(rng, shape, 34)).clip(0.2)
    inner = np.exp(-(inside.clip(0) / 0.035))
    pool = 0.045 * noise(rng, shape, 70) + 0.03 * noise(rng, shape, 26) + 0.012 * noise(rng, shape, 2.2)
    if k in (1, 3):  # a bloom: water that ran back into the wash; faint, as one sees it again and again
        way = np.hypot(x - (0.58, 0.34)[k // 2], (y - (0.62, 0.4)[k // 2] * height) * 1.15)
        way = way / (0.115 + 0.016 * noise(rng, shape, 26))
        pool += 0.06 * np.exp(-(((way - 1) / 0.12) ** 2)) - 0.05 * smoothstep(1.0, 0.3, way)
    film = 0.735 + pool + 0.06 * inner + 0.24 * rim
    return 0.5 + 0.05 * rim + 0.015 * pool, (touch * film).clip(0, 1)


def line(rng, k=0):
    """An even line of ink, to be joined with others: square ends, edges that waver a little."""
    x, y = canvas(16)
    shape = x.shape
    height = shape[0] / shape[1]
    half = 0.3 * height * (1 + 0.05 * noise(rng, shape[1], 90) + 0.035 * noise(rng, shape[1], 22))
    middle = 0.5 * height + height * (0.022 * noise(rng, shape[1], 130) + 0.012 * noise(rng, shape[1], 30))
    fibres = height * (0.014 * noise(rng, shape, (3, 7)) + 0.008 * noise(rng, shape, 2))
    ends = np.minimum(x, 1 - x) - 0.004 - 0.006 * (2 * (y / height - 0.5)) ** 2
    inside = np.minimum(half - np.abs(y - middle) + fibres, ends + fibres)
    touch = smoothstep(-0.0012, 0.0022, inside)
    film = 0.95 + 0.03 * noise(rng, shape, (12, 120)) + 0.05 * smoothstep(0.006, 0.002, inside)
    return 0.52 + 0.03 * smoothstep(0.0, 0.008, inside), (touch * film).clip(0, 1)


# Each with the number of its variants.
STROKES = {
    flat: 4,
    filbert: 4,
    dab: 4,
    impasto: 3,
    dry_brush: 3,
    fan: 2,
    swirl: 1,
    moon: 1,
    flower: 1,
    x: 1,
    ink: 3,
    palette_knife: 3,
    splatter: 1,
    charcoal: 4,
    wash: 4,
    line: 3,
}
IMAGES = {
    stroke.__name__ + (f"_{k + 1}" if k else ""): (stroke, k)
    for stroke, variants in STROKES.items()
    for k in range(variants)
}
# Images that are twice as wide, so that they are sharp in pictures of 3840 pixels too. The others keep their
# width, and with it every bit of what is painted with one stroke.
LARGE = {name for name, (stroke, k) in IMAGES.items() if k or stroke in (wash, line)}


def draw(name):
    """The stroke image called `name`, uint8 [h, w, 4] RGBA, straight alpha."""
    stroke, k = IMAGES[name]
    rng = np.random.default_rng([20, *name.encode()])
    return down(*(stroke(rng, k) if k else stroke(rng)), 2 * WIDTH if name in LARGE else WIDTH)


def write(name, folder):
    """Draw `name` and write it into `folder` as 8-bit PNG."""
    pixels = np.ascontiguousarray(draw(name))
    path = Path(folder) / f"{name}.png"
    spec = OpenImageIO.ImageSpec(pixels.shape[1], pixels.shape[0], 4, OpenImageIO.UINT8)
    spec.attribute("oiio:UnassociatedAlpha", 1)
    spec.attribute("png:compressionLevel", 9)
    out = OpenImageIO.ImageOutput.create(str(path))
    if not (out and out.open(str(path), spec) and out.write_image(pixels) and out.close()):
        raise OSError(f"{path}: cannot be written ({OpenImageIO.geterror()}); check the folder")
    return path


if __name__ == "__main__":
    for image in sys.argv[1:] or IMAGES:
        print(write(image, Path(__file__).resolve().parent))
