"""Coats and light as separate layers, which composited give the picture.

On an opaque ground there are the ground, a layer for each coat (glazes multiply), and three layers for the
lamp, since light is affine in color (see `Lighting`): `relief shade` multiplies where ridges are darker,
`relief light` divides where they are lighter, `light` adds highlights and color above 1, which other layers
cannot store. Without a ground such layers would change unpainted pixels, so glazes and the lamp are then
applied to the coats.
"""

from dataclasses import replace

import numpy as np

from brushgs.rendering.coat import Coat
from brushgs.rendering.deep import Lighting, Rest
from brushgs.values.arrays import Array
from brushgs.values.frame import LEAST, Frame, Sheet

_TINY = 1e-6
_PARTS = {"strokes": "subject", "backdrop": "stage", "cutting in": "stage: cutting in", "lines": "lines"}


class SheetMaker:
    """Collects the coats of one view as layers."""

    def __init__(self) -> None:
        self._laid: list[Sheet] = []

    def lay(self, coat: Coat, frame: Frame) -> None:
        """Add a coat; the arrays of its frame may be overwritten later."""
        name = _PARTS.get(coat.name, f"subject: {coat.name}")
        if coat.blend == "glaze":
            tint = Rest.glazes(frame.rgb)
            self._laid.append(Sheet(name, tint.rgb, tint.alpha, "multiply"))
        else:
            self._laid.append(Sheet(name, frame.rgb.copy(), frame.alpha.copy()))

    def result(self, ground: Array | None, lighting: Lighting | None) -> tuple[Sheet, ...]:
        """The layers, the lowest first, without empty ones.

        Args:
            ground: [H, W, 3] opaque; None for a transparent picture.
            lighting: None without a lamp.
        """
        if ground is None:
            sheets, _, lost = _clipped(_without_ground(self._laid, lighting))
            return _shown(_filled(sheets, lost))
        bottom = Sheet("ground", ground, np.ones(ground.shape[:2], ground.dtype))
        sheets, exact, lost = _clipped([bottom, *self._laid])
        if lighting is None:
            light = lost - np.maximum(exact - 1, 0)
        else:
            sheets += _relief(lighting)
            light = lost * lighting.factors[..., None] + lighting.shines[..., None]
        light = np.clip(light, 0, 1)
        # Opaque, and black where nothing is added: programs treat the alpha of additive layers differently.
        is_lit = np.full(light.shape[:2], light.max(initial=0) > LEAST, light.dtype)
        return _shown([*sheets, Sheet("light", light, is_lit, "plus")])


def _shown(sheets: list[Sheet]) -> tuple[Sheet, ...]:
    return tuple(sheet for sheet in sheets if sheet.alpha.max(initial=0) > LEAST)


def _clipped(sheets: list[Sheet]) -> tuple[list[Sheet], Array, Array]:
    """Layers clipped to colors of at most 1, the exact picture [H, W, 3], and what clipping removed."""
    exact = shown = np.zeros_like(sheets[0].rgb)
    found = []
    for sheet in sheets:
        passed = 1 - sheet.alpha[..., None]
        if sheet.mix == "multiply":
            exact, shown = exact * (sheet.rgb + passed), shown * (sheet.rgb + passed)
        else:
            exact = sheet.rgb + passed * exact
            sheet = replace(sheet, rgb=np.clip(sheet.rgb, 0, sheet.alpha[..., None]))
            shown = sheet.rgb + passed * shown
        found.append(sheet)
    return found, exact, np.maximum(exact - shown, 0)


def _filled(sheets: list[Sheet], lost: Array) -> list[Sheet]:
    """Distribute missing light [H, W, 3] to the layers, from the topmost down, for transparent pictures.

    A separate layer of light would make pixels opaque.
    """
    found, seen = list[Sheet](), np.ones_like(lost)  # visible share of a layer
    for sheet in reversed(sheets):
        passed = 1 - sheet.alpha[..., None]
        more = np.minimum(lost / np.maximum(seen, _TINY), sheet.alpha[..., None] - sheet.rgb)
        found.insert(0, replace(sheet, rgb=sheet.rgb + more))
        lost, seen = lost - seen * more, seen * passed
    return found


def _relief(lighting: Lighting) -> list[Sheet]:
    """Layers of light and shade on the ridges of an opaque picture."""
    shade = 1 - np.minimum(lighting.factors, 1)
    dodge = 1 - 1 / np.maximum(lighting.factors, 1)  # color-dodge divides by 1 - this
    is_lighter = np.full_like(dodge, dodge.any())
    return [
        Sheet("relief shade", np.zeros((*shade.shape, 3), shade.dtype), shade, "multiply"),
        Sheet("relief light", np.repeat(dodge[..., None], 3, axis=2), is_lighter, "color-dodge"),
    ]


def _without_ground(laid: list[Sheet], lighting: Lighting | None) -> list[Sheet]:
    """Coats with the light and the glazes above them applied; the glazes themselves as the lowest layer."""
    sheets: list[Sheet] = []
    above: Array | None = None
    for sheet in reversed(laid):
        if sheet.mix == "multiply":
            tint = sheet.rgb + (1 - sheet.alpha[..., None])
            above = tint if above is None else above * tint
        else:
            sheets.insert(0, sheet if above is None else replace(sheet, rgb=sheet.rgb * above))
    if above is not None:
        rest = Rest.glazes(above)
        sheets.insert(0, Sheet("glazes", rest.rgb, rest.alpha))
    return [_lit(sheet, lighting) for sheet in sheets]


def _lit(sheet: Sheet, lighting: Lighting | None) -> Sheet:
    if lighting is None:
        return sheet
    rgb = sheet.rgb * lighting.factors[..., None] + (sheet.alpha * lighting.shines)[..., None]
    return replace(sheet, rgb=rgb)
