"""Write strokes as SVG paths: layers by coat and region, and a page in the color of the ground.

Source: W3C, Scalable Vector Graphics (SVG) 1.1; `inkscape:groupmode` makes a group a layer in Inkscape, and
in vpype, which plots it.
"""

import math
import re
from collections.abc import Iterator, Sequence
from pathlib import Path
from xml.sax.saxutils import escape, quoteattr, unescape

import numpy as np

from brushgs.formats.files import open_plain, replacing
from brushgs.formats.pictures.metadata import metadata_text
from brushgs.values.arrays import F64
from brushgs.values.colors import code_of
from brushgs.values.paths import Path2D, PathGroup, Paths
from brushgs.values.shot import Shot

TENTHS = 10  # coordinates are rounded to tenths of a pixel
# Soft ellipses need one gradient per color: colors are quantized to the most steps that keep the limit.
MOST_GRADIENTS, COLOR_STEPS = 400, (255, 63, 31, 15, 6)
STOPS = 9  # of the gradient of a soft ellipse
_NAME = re.compile(r"[^a-zA-Z0-9]+")
_MOST_TEXT = 1 << 17  # bytes at the start of a file that are searched for metadata


def write_svg(paths: Paths, path: str | Path, *, shot: Shot | None = None) -> None:
    """Write paths and the metadata of a shot; the file appears when it is complete.

    Equal paths give equal bytes. Raises SceneError if the file cannot be written.
    """
    text = "".join(_lines_of(paths, metadata_text(shot)))
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8")


def read_description(path: Path) -> str:
    """The metadata stored by `write_svg`; "" if there are none."""
    with open_plain(path, "picture") as file:
        begin = file.read(_MOST_TEXT).decode("utf-8", "replace")
    found = re.search(r"<desc>(.*?)</desc>", begin, re.DOTALL)
    return "" if found is None else unescape(found[1])


def _lines_of(paths: Paths, description: str) -> Iterator[str]:
    size = f'width="{paths.width}" height="{paths.height}" viewBox="0 0 {paths.width} {paths.height}"'
    spaces = 'xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
    yield f'<?xml version="1.0" encoding="UTF-8"?>\n<svg {spaces} {size}>\n'
    if description:
        yield f"<desc>{escape(description)}</desc>\n"
    if any(group.multiplies for group in paths.groups):
        yield "<style>.glaze *{mix-blend-mode:multiply}</style>\n"
    soft = [path for group in paths.groups for path in group.paths if path.kind == "soft"]
    if soft:
        steps = next(n for n in COLOR_STEPS if len({_code(path, n) for path in soft}) <= MOST_GRADIENTS)
        yield from _gradients(sorted({_code(path, steps) for path in soft}))
    if paths.ground is not None:
        color = code_of(paths.ground)
        yield f'<rect id="page" width="{paths.width}" height="{paths.height}" fill="{color}"/>\n'
    yield from _layers_of(paths.groups, steps if soft else 255)
    yield "</svg>\n"


def _layers_of(groups: Sequence[PathGroup], steps: int) -> Iterator[str]:
    """A layer for each run of groups of one coat, and one within it for each region."""
    coat, number = "", 0
    for group in groups:
        if group.coat != coat:
            number += 1
            yield ("</g>\n" if coat else "") + _layer(f"{number}-{group.coat}", group.coat, group)
        coat = group.coat
        if group.region:
            yield _layer(f"{number}-{group.coat}-{group.region}", group.region, None)
        for path in group.paths:
            yield _shape(path, steps)
        if group.region:
            yield "</g>\n"
    if coat:
        yield "</g>\n"


def _layer(name: str, label: str, group: PathGroup | None) -> str:
    style = ""
    if group is not None:
        style = ' stroke-linecap="butt" stroke-linejoin="round"' + ' class="glaze"' * group.multiplies
    identity = "coat-" + _NAME.sub("-", name).strip("-").lower()
    return f'<g id="{identity}" inkscape:label={quoteattr(label)} inkscape:groupmode="layer"{style}>\n'


def _gradients(codes: list[str]) -> Iterator[str]:
    """A radial gradient for each color: exp(-4.5 r^2), as the kernel of 3DGS, clipped at r = 1."""
    yield "<defs>\n"
    for code in codes:
        stops = "".join(
            f'<stop offset="{k / STOPS:.2f}" stop-color="{code}" '
            f'stop-opacity="{math.exp(-4.5 * (k / STOPS) ** 2):.3f}"/>'
            for k in range(STOPS + 1)
        )
        yield f'<radialGradient id="s{code[1:]}">{stops}</radialGradient>\n'
    yield "</defs>\n"


def _code(path: Path2D, steps: int = 255) -> str:
    """#rrggbb, with each channel quantized to `steps` steps."""
    return code_of([round(steps * one) / steps for one in path.color])


def _shape(path: Path2D, steps: int) -> str:
    """The SVG element of a path; `steps` quantizes the colors of soft ellipses."""
    code = _code(path, steps if path.kind == "soft" else 255)
    opacity = f"{path.opacity:.2f}".rstrip("0").rstrip(".") or "0"
    if path.kind == "line":
        seen = "" if path.opacity > 0.995 else f' stroke-opacity="{opacity}"'
        width = f"{max(path.width, 0.01):.2f}"
        return f'<path d="{_drawn(path.points)}" fill="none" stroke="{code}" stroke-width="{width}"{seen}/>\n'
    seen = "" if path.opacity > 0.995 else f' fill-opacity="{opacity}"'
    if path.kind == "area":
        return f'<path d="{_drawn(path.points)}z" fill="{code}"{seen}/>\n'
    x, y = path.points[0]
    if path.kind == "dot":
        return f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{path.width / 2:.2f}" fill="{code}"{seen}/>\n'
    along, across = path.points[1] - path.points[0], path.points[2] - path.points[0]
    angle = math.degrees(math.atan2(along[1], along[0]))
    radii = f'rx="{np.hypot(*along):.1f}" ry="{np.hypot(*across):.1f}"'
    turned = f'transform="translate({x:.1f} {y:.1f}) rotate({angle:.1f})"'
    return f'<ellipse {radii} {turned} fill="url(#s{code[1:]})"{seen}/>\n'


def _drawn(points: F64) -> str:
    """Path data of rings or a line: relative steps between rounded points, so that errors do not add up."""
    gaps = np.flatnonzero(np.isnan(points[:, 0]))
    rings = np.split(points, gaps)
    return "z".join(_ring(ring[k > 0 :]) for k, ring in enumerate(rings))


def _ring(points: F64) -> str:
    tenths = np.rint(points * TENTHS).astype(np.int64)
    x, y = tenths[0].tolist()
    steps = " ".join(f"{_number(dx)},{_number(dy)}" for dx, dy in np.diff(tenths, axis=0).tolist())
    return f"M{_number(x)},{_number(y)}l{steps}"


def _number(tenths: int) -> str:
    whole, rest = divmod(abs(tenths), TENTHS)
    sign = "-" if tenths < 0 else ""
    return f"{sign}{whole}.{rest}" if rest else f"{sign}{whole}"
