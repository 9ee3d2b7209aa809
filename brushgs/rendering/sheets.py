"""Coats and light as separate layers, which laid on each other are the picture.

On an opaque ground: the ground, a layer for each coat (glazes multiply), and the lamp as three layers, since
light is affine in colour (see `Lighting`): `relief shade` multiplies where ridges are darker, `relief light`
divides where they are lighter, `light` adds highlights, and the light that layers of colours up to 1 cannot
hold. Without a ground such layers would change pixels that nothing was painted on, so glazes and the lamp are
then part of the coats.
"""

from dataclasses import replace

import numpy as np

from brushgs.rendering.coat import Coat
from brushgs.rendering.deep import Lighting, Rest
from brushgs.values.arrays import Array
from brushgs.values.frame import Frame
from brushgs.values.sheets import Sheet

LEAST = 0.5 / 255  # alpha that 8 bits hold
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
        """The layers, the lowest first; those that show nothing are left out.

        Args:
            ground: [H, W, 3] opaque; None for a transparent picture.
            lighting: None without a lamp.
        """
        if ground is None:
            sheets, lost = _clipped(_without_ground(self._laid, lighting))
            lighting = None
        else:
            bottom = Sheet("ground", ground, np.ones(ground.shape[:2], ground.dtype))
            sheets, lost = _clipped([bottom, *self._laid])
        if lighting is not None:
            sheets += _relief(lighting)
            lost = lost * np.minimum(lighting.factors, 1)[..., None] + lighting.shines[..., None]
        light = np.clip(lost, 0, 1)
        sheets.append(Sheet("light", light, light.max(axis=2), "plus"))
        return tuple(sheet for sheet in sheets if sheet.alpha.max(initial=0) > LEAST)


def _clipped(sheets: list[Sheet]) -> tuple[list[Sheet], Array]:
    """Layers of colours of at most 1, which files hold, and the light [H, W, 3] that they lack together.

    What a layer loses, the next ones above it make up for. Where a pixel is not opaque, nothing is lacking:
    light that is added would make it so.
    """
    exact = shown = np.zeros_like(sheets[0].rgb)
    through = np.ones_like(sheets[0].alpha)
    found = []
    for sheet in sheets:
        passed = 1 - sheet.alpha[..., None]
        through = through * passed[..., 0]
        if sheet.mix == "multiply":
            exact, shown = exact * (sheet.rgb + passed), shown * (sheet.rgb + passed)
        else:
            exact = sheet.rgb + passed * exact
            sheet = replace(sheet, rgb=np.clip(exact - passed * shown, 0, sheet.alpha[..., None]))
            shown = sheet.rgb + passed * shown
        found.append(sheet)
    return found, np.where(through[..., None] < LEAST, np.maximum(exact - shown, 0), 0)


def _relief(lighting: Lighting) -> list[Sheet]:
    """Light and shade on the ridges of an opaque picture."""
    shade = 1 - np.minimum(lighting.factors, 1)
    dodge = 1 - 1 / np.maximum(lighting.factors, 1)  # color-dodge divides by 1 - this
    is_lighter = np.full_like(dodge, dodge.any())
    return [
        Sheet("relief shade", np.zeros((*shade.shape, 3), shade.dtype), shade, "multiply"),
        Sheet("relief light", np.repeat(dodge[..., None], 3, axis=2), is_lighter, "color-dodge"),
    ]


def _without_ground(laid: list[Sheet], lighting: Lighting | None) -> list[Sheet]:
    """Coats under the light and the glazes above them; the glazes themselves at the bottom."""
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
