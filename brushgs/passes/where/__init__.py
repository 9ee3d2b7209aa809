"""Membership of each Gaussian, 0 to 1, in a part of the scene.

    term -> signed distance or mask -> membership; `and` takes the minimum, `or` the maximum, `not` 1 minus it

One module for each kind of term; `evaluate` combines them.
"""

from brushgs.passes.where.evaluate import WhereContext, memberships, sides

__all__ = ["WhereContext", "memberships", "sides"]
