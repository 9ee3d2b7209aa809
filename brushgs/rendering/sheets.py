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
from brushgs.values.sheets import LEAST, Sheet

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
        """The layers, the lowest first; those that show nothing are left out.

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
        # Opaque, black where nothing is added: programs differ on how alpha counts where layers add.
        is_lit = np.full(light.shape[:2], light.max(initial=0) > LEAST, light.dtype)
        return _shown([*sheets, Sheet("light", light, is_lit, "plus")])


def _shown(sheets: list[Sheet]) -> tuple[Sheet, ...]:
    return tuple(sheet for sheet in sheets if sheet.alpha.max(initial=0) > LEAST)


def _clipped(sheets: list[Sheet]) -> tuple[list[Sheet], Array, Array]:
    """Layers of colours of at most 1, which files hold, the picture [H, W, 3], and what they lack of it."""
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
    """Layers with the light [H, W, 3] that others lack, the uppermost first: for pixels that are not solid.

    Light in a layer of its own would make them solid.
    """
    found, seen = list[Sheet](), np.ones_like(lost)  # share of a layer that shows
    for sheet in reversed(sheets):
        passed = 1 - sheet.alpha[..., None]
        more = np.minimum(lost / np.maximum(seen, _TINY), sheet.alpha[..., None] - sheet.rgb)
        found.insert(0, replace(sheet, rgb=sheet.rgb + more))
        lost, seen = lost - seen * more, seen * passed
    return found


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
