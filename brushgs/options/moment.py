"""A moment of a moving scene, as options name it."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Moment:
    """A time of a moving scene.

    Attributes:
        amount: seconds, >= 0; or of its duration the share, 0 to 1.
        is_share: whether it is a share.

    Raises:
        ValueError: if it is out of range.
    """

    amount: float
    is_share: bool = False

    def __post_init__(self) -> None:
        most = 1.0 if self.is_share else float("inf")
        if not 0 <= self.amount <= most or self.amount == float("inf"):
            rule = "0% to 100% of the clip" if self.is_share else "0 or more seconds"
            raise ValueError(f"time must be {rule}, got {self}")

    def seconds(self, duration: float) -> float:
        """The time in a scene of this duration."""
        return self.amount * duration if self.is_share else self.amount

    def __str__(self) -> str:
        return f"{100 * self.amount:g}%" if self.is_share else f"{self.amount:g} s"
