"""Numbers shared by page and renderer, defined once in Python for shaders and scripts.

Scripts have them as `SHARED`, shaders as constants by `#include "shared.glsl"`.
"""

from collections.abc import Mapping
from types import MappingProxyType

from brushgs.brushes import levels
from brushgs.brushes.texture import FITTED_REACH, KERNEL_SIGMAS, TINT_ZERO
from brushgs.cameras.framing import NEAR_SHARE
from brushgs.options.page import UNDERPAINT_STEP
from brushgs.outlets.page import fields
from brushgs.rendering import (
    border,
    canonical,
    canvas,
    constants,
    depth_test,
    facing,
    glaze,
    light,
    nested,
    reference,
    relief,
    rub,
    space_noise,
    streaks,
    surface,
    tonal,
    tooth,
    wet_layer,
)
from brushgs.values.colors import LUMINANCE
from brushgs.values.hashing import GOLDEN_32

INTEGERS = frozenset({"GOLDEN_32"})  # of 32 bits, which a float cannot hold
Shared = float | tuple[float, float] | list[list[int]] | list[list[float]]

# Names are those in Python if they are clear alone.
SHARED: Mapping[str, Shared] = MappingProxyType(
    {
        "NEAR_SHARE": NEAR_SHARE,
        "MIN_ALPHA": constants.MIN_ALPHA,
        "MAX_ALPHA": constants.MAX_ALPHA,
        "MIN_TRANSMITTANCE": constants.MIN_TRANSMITTANCE,
        "GAUSSIAN_SIGMAS": constants.GAUSSIAN_SIGMAS,
        "CLAMP": reference.CLAMP,
        "ANCHOR_PULL": reference.ANCHOR_PULL,
        "FIELD_LEVELS": fields.LEVELS,
        "FIELD_SINGULAR": canonical.SINGULAR,
        "FIELD_SOFT": canonical.SOFT,
        "FADED_NEAR": reference.FADED_NEAR,
        "BORDER_LEFT": border.LEFT_AT_BORDER,
        "BORDER_SPREAD": border.SPREAD,
        "BORDER_FADE": border.FADE,
        "FACING_BOUNDS": facing.BOUNDS,
        "NESTED_BOUNDS": (nested.GONE, nested.WHOLE),
        "LEAST_FACING": nested.LEAST_FACING,
        "THINNEST": nested.THINNEST,
        "SMALLEST": nested.SMALLEST,
        "SHORT": nested.SHORT,
        "LONG": nested.LONG,
        "NESTED_PIXELS": float(nested.PIXELS),
        "BEHIND_BOUNDS": facing.BEHIND,
        "SOLID_BELOW": depth_test.SOLID,
        "DARKEST": glaze.DARKEST,
        "TOOTH_SOFTNESS": tooth.SOFTNESS,
        "HIDES_BOUNDS": (tonal.CLEAR, tonal.SOLID),
        "FINE": (tonal.FINE, tonal.FINE_EDGE),
        "HALO": tonal.HALO,
        "JUMP": tonal.JUMP,
        "BROAD": (tonal.BROAD, tonal.BROAD_EDGE),
        "OUTLINE_BLUR": tonal.EDGE,
        "OUTLINE_LEVEL": tonal.ROUND,
        "OUTLINE_SHARP": tonal.SHARP,
        "INK_LAID": tonal.LAID,
        "INK_SKIRT": tonal.SKIRT,
        "INK_FADED": tonal.FADED,
        "WET_ROUNDS": wet_layer.ROUNDS,
        "WET_SPILL": wet_layer.SPILL,
        "WET_RIM": wet_layer.RIM,
        "WET_LOSS": wet_layer.LOSS,
        "WET_PAPER": wet_layer.PAPER,
        "WET_VEIL": wet_layer.VEIL,
        "WET_WIDTHS": [list(wet_layer.WIDTHS)],
        "WET_CORE": wet_layer.CORE,
        "WET_NEAR_CORE": wet_layer.NEAR_CORE,
        "WET_OPENED": wet_layer.OPENED,
        "WET_LIT": wet_layer.LIT,
        "WET_STEEP": wet_layer.STEEP,
        "WET_FROM_ABOVE": wet_layer.FROM_ABOVE,
        "WET_CONTACT": wet_layer.CONTACT,
        "ROOM_SOLID": wet_layer.ROOM_SOLID,
        "WET_HOLE": wet_layer.HOLE,
        "WET_HOLE_CLOSED": (wet_layer.OPEN, wet_layer.CLOSED),
        "SHADOW_RANGE": (wet_layer.SHADOW_EDGE, wet_layer.SHADOW_WANDER),
        "SHADOW_FADE": (wet_layer.SHADOW_SOFTNESS, wet_layer.SHADOW_LEAST),
        "RUB_RISE": rub.RISE,
        "RUB_GATHERED": rub.GATHERED,
        "RUB_SOLID": rub.SOLID,
        "RUB_BLURS": (rub.SHARP, rub.SOFT),
        "RUB_REACH": rub.TRUNCATED,
        "RUB_TOOTH": rub.TOOTH,
        "RUB_STEP": rub.STEP,
        "RUB_FINEST": rub.FINEST,
        "LEAST_COLOR": wet_layer.LEAST_COLOR,
        "GRAIN_DEVIATION": wet_layer.GRAIN_DEVIATION,
        "LUMINANCE": [list(LUMINANCE)],
        "NOISE_FINEST": space_noise.FINEST,
        "NOISE_OCTAVES": space_noise.OCTAVES,
        "NOISE_DEVIATION": space_noise.DEVIATION,
        "NOISE_PERSISTENCE": space_noise.PERSISTENCE,
        "NOISE_PRIMES": [list(space_noise.PRIMES)],
        "CARRIED": canvas.CARRIED,
        "UNDERPAINT_STEP": UNDERPAINT_STEP,
        "UNDERPAINT_THICKNESS": relief.UNDERPAINT_THICKNESS,
        "CANVAS_PIXELS": relief.CANVAS_PIXELS,
        "LIGHT_REACH": light.REACH,
        "BRISTLES": streaks.BRISTLES,
        "STREAK_PERIOD": streaks.PERIOD,
        "STREAK_NOISE": streaks.noise().tolist(),
        "BRISTLE_FADE": streaks.BRISTLE_FADE,
        "TUFT_FADE": streaks.TUFT_FADE,
        "FITTED_REACH": FITTED_REACH,
        "TINT_ZERO": TINT_ZERO,
        "IMAGE_SIGMAS": KERNEL_SIGMAS["image"],
        "FIRST_FOOTPRINT": levels.FIRST_FOOTPRINT,
        "LEVELS_PER_OCTAVE": levels.LEVELS_PER_OCTAVE,
        "TEXELS_PER_PIXEL": levels.TEXELS_PER_PIXEL,
        "MARGIN_PIXELS": levels.MARGIN_PIXELS,
        "SHORTEST_BOX": levels.SHORTEST_BOX,
        "GOLDEN_32": GOLDEN_32,
        "NOISE_GAIN": surface.NOISE_GAIN,
        "THREAD_PERIOD": surface.PERIOD,
        "THREADS_BEFORE": surface.BEFORE,
        "THREAD_SPACING": surface.SPACING,
        "NARROW_THREAD": surface.NARROW_THREAD,
        "SLUBS": surface.SLUBS,
        "WAVES": surface.WAVES,
        "WAVE_LENGTH": surface.WAVE_LENGTH,
        "OVER": surface.OVER,
        "WEAVE_MEAN": surface.WEAVE_MEAN,
        "WEAVE_DEVIATION": surface.WEAVE_DEVIATION,
        "LINEN_HEIGHT": surface.LINEN_HEIGHT,
        "LINEN_TONE": surface.LINEN_TONE,
        "PAPER_SPACINGS": (surface.PAPER_COARSE, surface.PAPER_FINE),
        "PAPER_SHARES": surface.PAPER_SHARES,
        "PAPER_HEIGHT": surface.PAPER_HEIGHT,
        "PAPER_TONE": surface.PAPER_TONE,
    }
)


def shared_glsl() -> str:
    """The single numbers, and the pairs, as constants of a shader: floats, whatever they are in Python."""
    lines = []
    for name, value in SHARED.items():
        if isinstance(value, tuple):
            lines.append(f"const vec2 {name} = vec2({', '.join(repr(float(each)) for each in value)});")
        elif not isinstance(value, list) and name not in INTEGERS:
            lines.append(f"const float {name} = {float(value)!r};")
    return "\n".join(lines) + "\n"
