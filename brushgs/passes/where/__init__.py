"""Which Gaussians lie in a part of the scene: a membership of 0 to 1 for each.

    term -> signed distance or mask -> membership, `and` the lowest, `or` the highest, `not` 1 less it

One module for each kind of term; `evaluate` combines them.
"""

from brushgs.passes.where.evaluate import WhereContext, memberships, sides

__all__ = ["WhereContext", "memberships", "sides"]
