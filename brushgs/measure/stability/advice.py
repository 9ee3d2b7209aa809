"""One line of advice on the lock for a path, from its figures."""

from brushgs.measure.stability.figures import Figures, Stability

LOCKS = "track", "anchor", "off"  # differ only in their lock; the first wins a tie
IS_DEFAULT = {LOCKS[0]: " (the default)"}  # of `render` along a path
COARSE = 0.01  # share of the painted area that turns or jumps in a frame: above it smaller steps are advised


def advice(result: Stability) -> str:
    """The steadiest lock and its lead: "for this path --lock track (the default) is steadiest: ...".

    Locks are compared by the share of the painted area in strokes that flip, spin or pop from frame to frame.
    """
    locks = [result[name] for name in LOCKS]
    if all(figures.events == locks[0].events for figures in locks):
        return "for this path every lock draws the same strokes: none of them has a direction to hold"
    best = min(locks, key=_unsteady)
    others = " and ".join(f"{_unsteady(other):.2%} with {other.name}" for other in locks if other is not best)
    name = f"{best.name}{IS_DEFAULT.get(best.name, '')}"
    line = (
        f"for this path --lock {name} is steadiest: {_unsteady(best):.2%} of the painted area turns or "
        f"jumps in a frame, {others}"
    )
    if best.warps:
        excess = max(0.0, 255 * best.warps[0].excess)
        line += f"; it flickers by {excess:.1f} of 255 more than the plain picture"
    if _unsteady(best) > COARSE:
        line += "; smaller steps of the camera (more frames) would be steadier"
    return line


def _unsteady(figures: Figures) -> float:
    """Share of the painted area in strokes that change abruptly from a frame to the next."""
    events = figures.events
    assert events is not None, "strokes in space have events"
    return events.flip_share + events.spin_share + events.pop_share
