"""Plain names of colors, as painters use them: "deep blue", "warm gray", "ochre".

Names follow from lightness L, chroma C and hue in OKLab. The families and their limits were set by looking at
charts of them; a name describes a color, not a pigment.
"""

import numpy as np

from brushgs.values.arrays import F64
from brushgs.values.colors import oklab_of

_GREY, _TINTED = 0.008, 0.034  # largest chroma of a gray, and of a warm or cool gray
_WARM = (0.0, 125.0)  # degrees of hue; from 340 on as well
# First degree of hue of each family; hues below the first belong to the last family.
_HUES = (
    *((10, "red"), (42, "orange"), (70, "gold"), (98, "yellow"), (117, "yellow-green"), (133, "green")),
    *((164, "teal"), (212, "sky blue"), (245, "blue"), (281, "violet"), (308, "purple"), (342, "crimson")),
)
_BROWNS = {"red": "russet", "orange": "brown", "gold": "umber", "yellow": "olive", "yellow-green": "olive"}
_EARTHS = {"red": "brick", "orange": "sienna", "gold": "ochre", "yellow": "olive", "yellow-green": "moss"}
_PALES = {"red": "pink", "orange": "peach", "gold": "cream", "yellow": "cream", "crimson": "pink"}


def color_name(rgb: F64) -> str:
    """The name of a display-encoded color [3], 0 to 1; values outside the range are not clipped."""
    lightness, a, b = oklab_of(np.asarray(rgb, np.float64)[None])[0]
    chroma, hue = float(np.hypot(a, b)), float(np.degrees(np.arctan2(b, a)) % 360)
    if chroma < _TINTED * min(1.0, 0.4 + float(lightness)):
        return _grey_name(float(lightness), chroma, hue)
    family = next((name for first, name in reversed(_HUES) if hue >= first), _HUES[-1][1])
    return _toned(family, float(lightness), chroma)


def color_names(colors: F64) -> list[str]:
    """Distinct names of several colors [k, 3]: equal names are told apart by tone, then by number."""
    plain = [color_name(rgb) for rgb in colors]
    lightness = oklab_of(np.asarray(colors, np.float64))[:, 0]
    names = list(plain)
    for name in set(plain):
        rows = sorted(
            (row for row, other in enumerate(plain) if other == name), key=lambda row: -lightness[row]
        )
        if len(rows) in (2, 3):
            for row, tone in zip(
                rows, ["lighter", "middle", "darker"][:: 1 if len(rows) == 3 else 2], strict=True
            ):
                names[row] = f"{tone} {name}"
        elif len(rows) > 3:
            for number, row in enumerate(rows):
                names[row] = f"{name} {number + 1}"
    return names


def _grey_name(lightness: float, chroma: float, hue: float) -> str:
    steps = ((0.17, "black"), (0.40, "dark grey"), (0.68, "grey"), (0.90, "light grey"))
    name = next((name for limit, name in steps if lightness < limit), "white")
    if chroma < _GREY or name == "black":
        return name
    tint = "warm" if _WARM[0] <= hue < _WARM[1] or hue >= 340 else "cool"
    tone, _, last = name.rpartition(" ")
    return " ".join(word for word in (tone, tint, last) if word)


def _toned(family: str, lightness: float, chroma: float) -> str:
    if lightness < 0.48:
        return _dark_name(family, lightness, chroma)
    if lightness > 0.80 and family in _PALES and chroma < 0.11:
        return ("pale " if chroma < 0.05 else "") + _PALES[family]
    if lightness < 0.74 and family in _EARTHS and chroma < 0.145:
        return ("muted " if chroma < 0.06 else "") + _EARTHS[family]
    if lightness > 0.74:
        return ("pale " if chroma < 0.07 else "light " if chroma < 0.16 else "bright ") + family
    return ("muted " if chroma < 0.06 else "bright " if chroma > 0.17 else "") + family


def _dark_name(family: str, lightness: float, chroma: float) -> str:
    if family in _BROWNS and not (family == "red" and chroma > 0.11):
        return ("deep " if lightness < 0.30 else "") + _BROWNS[family]
    return ("dark " if chroma < 0.06 or lightness < 0.22 else "deep ") + family
