"""How many Gaussians fit into memory, and how many processes read them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from brushgs.core.memory import machine_memory
from brushgs.core.threads import num_threads_or_default
from brushgs.options.memory_size import memory_words

if TYPE_CHECKING:
    from brushgs.formats.scenes.rows import SceneFile

# Bytes that a painting takes at its peak, measured on landscapes of one and two million Gaussians: 550 each
# without spherical harmonics, 1000 with those of degree 3.
FOR_EACH, FOR_EACH_TERM, FOR_ALL = 600, 30, 200 << 20
USUAL_SHARE = 0.75  # of the machine's memory; the rest is for other programs
# Maximum number of Gaussians after merging, whatever the memory: 300 for each of 7000 strokes. With 15 for
# each a painting is half a decibel worse, with 60 a quarter.
MOST_MERGED = 1 << 21
FEWEST = 1 << 14  # minimum capacity, however small the budget
MOST_PROCESSES = 4  # more processes give sums faster than they are added up
FOR_PROCESS = 300 << 20  # bytes


@dataclass(frozen=True)
class Budget:
    """Memory that a painting may take.

    Attributes:
        memory: bytes; None if the system does not report its memory: then everything fits.
    """

    memory: int | None

    @classmethod
    def of(cls, memory: int | None) -> "Budget":
        """A budget in bytes; None for three quarters of the machine's memory, see `machine_memory`."""
        if memory is None and (known := machine_memory()) is not None:
            memory = int(USUAL_SHARE * known)
        return cls(memory)

    def capacity(self, num_terms: int) -> int | None:
        """How many Gaussians with `num_terms` spherical-harmonic terms fit; None for any number."""
        if self.memory is None:
            return None
        return max(FEWEST, (self.memory - FOR_ALL) // bytes_each(num_terms))

    def is_below(self, files: "Sequence[SceneFile]") -> bool:
        """Whether a scene needs more; strokes, and a moment of a moving scene, never do."""
        if all(file.stored.is_strokes for file in files) or any(file.moment is not None for file in files):
            return False
        capacity = self.capacity(_most_terms(files))
        return capacity is not None and _num_rows(files) > capacity

    def words(self, files: "Sequence[SceneFile]") -> str:
        """By how much a scene is too large, in words."""
        assert self.memory is not None, "everything fits"
        size = FOR_ALL + _num_rows(files) * bytes_each(_most_terms(files))
        return f"strokes of them take {memory_words(size)} of memory, {memory_words(self.memory)} may be used"

    def num_processes(self) -> int:
        """Default number of processes of this machine that read blocks."""
        most = MOST_PROCESSES if self.memory is None else max(1, self.memory // 4 // FOR_PROCESS)
        return min(num_threads_or_default(None), MOST_PROCESSES, most)


def bytes_each(num_terms: int) -> int:
    """Bytes of memory for each Gaussian with `num_terms` spherical-harmonic terms."""
    return FOR_EACH + FOR_EACH_TERM * (num_terms - 1)


def _num_rows(files: "Sequence[SceneFile]") -> int:
    return sum(file.num_rows for file in files)


def _most_terms(files: "Sequence[SceneFile]") -> int:
    return max(file.num_terms for file in files)
