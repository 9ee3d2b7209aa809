"""Effects of coats in a page: what it makes of each, and what it needs for that.

Scripts make them at rest: `web/blacks.js`, `web/washes.js`, `web/rub.js`. A picture that moves has stand-ins:
`web/wet.js` for washes.
"""

from collections.abc import Iterator
from dataclasses import asdict, fields, replace
from operator import mul
from typing import TYPE_CHECKING, Any

from brushgs.rendering.effect import without_effect
from brushgs.values.arrays import F64

if TYPE_CHECKING:
    from brushgs.rendering.canvas import Painting
    from brushgs.rendering.coat import Coat
    from brushgs.rendering.rub import Rub
    from brushgs.rendering.space_noise import Anchor
    from brushgs.rendering.tonal import Blacks


def in_page(painting: "Painting") -> "Painting":
    """The painting with the strokes that a page draws: in tones where the page makes blacks of them."""

    def shown(coat: "Coat") -> "Coat":
        return replace(coat, effect=None) if _blacks(coat) else without_effect(coat)

    return replace(painting, coats=tuple(map(shown, painting.coats)))


def effect_facts(coat: "Coat", origin: F64) -> dict[str, Any]:
    """What the header of a coat says of its effect; points are relative to the origin, world units."""
    from brushgs.rendering.tonal import Blacks

    blacks = _blacks(coat)
    numbers = None
    if blacks is not None:
        numbers = {
            "threshold": blacks.threshold,
            "leastArea": blacks.least_area,
            "ink": list(blacks.ink),
            "paper": list(blacks.paper),
        }
    return {
        "isHiding": isinstance(coat.effect, Blacks),
        "blacks": numbers,
        "washes": _wash_facts(coat, origin),
        "rub": _rub_facts(coat, origin),
    }


def omitted_of(coat: "Coat", *, moves: bool) -> Iterator[str]:
    """Sentences on what a page does not show of the effect of a coat, at rest or in motion."""
    from brushgs.rendering.tonal import Blacks

    effect = coat.effect
    if effect is None:
        return
    if _blacks(coat):
        yield f"{effect.traits} have rougher outlines while the page moves, and small ones stay"
    elif has_washes(coat) and not moves:
        yield f"{effect.traits} are coarser while the page moves; in a headset strokes lie one by one"
    elif _rub(coat) and not moves:
        yield f"{effect.traits} are shown at rest only: in motion strokes lie one by one"
    elif not isinstance(effect, Blacks):
        yield f"{effect.traits} are not in the page: strokes lie one by one"


def has_washes(coat: "Coat") -> bool:
    """Whether the effect of a coat is washes that a page makes."""
    from brushgs.rendering.wet_layer import ShadowWash, WetLayer

    return isinstance(coat.effect, WetLayer | ShadowWash) and _is_whole(coat)


def _blacks(coat: "Coat") -> "Blacks | None":
    from brushgs.rendering.tonal import Blacks

    return coat.effect if isinstance(coat.effect, Blacks) and coat.effect.threshold > 0 else None


def _wash_facts(coat: "Coat", origin: F64) -> dict[str, Any] | None:
    from brushgs.rendering.wet_layer import ShadowWash, WetLayer

    effect = coat.effect
    if not has_washes(coat) or not isinstance(effect, WetLayer | ShadowWash):
        return None
    facts: dict[str, Any] = {
        "washes": {one.name: getattr(effect.washes, one.name) for one in fields(effect.washes)},
        "anchor": _anchor(effect.anchor, origin),
    }
    if isinstance(effect, WetLayer):
        smoothing = [[one.width, one.edge, one.wet, one.loose] for one in effect.smoothing]
        facts |= {"key": asdict(effect.key), "smoothing": smoothing, "isRoom": effect.is_room}
        facts |= {"towards": effect.towards, "losing": effect.losing}
        ground = effect.ground
        facts["ground"] = ground and [*ground[:3], ground[3] + sum(map(mul, ground, origin.tolist()))]
    return facts


def _rub(coat: "Coat") -> "Rub | None":
    """The rubbing of a coat, if a page makes it."""
    from brushgs.rendering.rub import Rub

    return coat.effect if isinstance(coat.effect, Rub) and _is_whole(coat) else None


def _is_whole(coat: "Coat") -> bool:
    """Whether a coat is painted in all of the scene, without parts that stay as they are."""
    return coat.cut is None and coat.plain is None


def _rub_facts(coat: "Coat", origin: F64) -> dict[str, Any] | None:
    rub = _rub(coat)
    if rub is None:
        return None
    return {
        "paper": list(rub.paper),
        "black": list(rub.black),
        "values": list(rub.values),
        "strength": rub.strength,
        "wave": rub.wave,
        "waves": rub.waves(origin).tolist(),
        "isRoom": rub.is_room,
    }


def _anchor(anchor: "Anchor", origin: F64) -> dict[str, Any]:
    return {
        "center": (anchor.center - origin).tolist(),
        "scale": anchor.scale,
        "focus": (anchor.focus - origin).tolist(),
        "reach": anchor.reach,
        "seed": anchor.seed,
    }
