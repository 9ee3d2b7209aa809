"""Two views compared in one call."""

from brushgs.measure.warp import View, WarpError, match_views
from brushgs.values.arrays import Array


def warp_error(
    first: View, second: View, *, displacement: Array | None = None, keep_map: bool = False
) -> WarpError:
    """The flicker between the pictures of two views."""
    return match_views(first, second, displacement).error(first.rgb, second.rgb, keep_map=keep_map)
