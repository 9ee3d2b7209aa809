"""How many Gaussians fit into memory, and what reads them there."""

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
USUAL_SHARE = 0.75  # of the machine's memory: it has other things to do
# Gaussians that larger scenes are merged to at most, whatever the memory: 300 for each of 7000 strokes. With
# 15 for each a painting is half a decibel worse, with 60 a quarter.
MOST_MERGED = 1 << 21
FEWEST = 1 << 14  # less memory than these take is no budget
MOST_PROCESSES = 4  # the sums of more are not added up as fast as they come
FOR_PROCESS = 300 << 20  # bytes


@dataclass(frozen=True)
class Budget:
    """Memory that a painting may take.

    Attributes:
        memory: bytes; None where the system does not tell how much there is: then everything fits.
    """

    memory: int | None

    @classmethod
    def of(cls, memory: int | None) -> "Budget":
        """So many bytes; None for three quarters of what the machine has, see `machine_memory`."""
        if memory is None and (known := machine_memory()) is not None:
            memory = int(USUAL_SHARE * known)
        return cls(memory)

    def capacity(self, num_terms: int) -> int | None:
        """How many Gaussians of so many spherical-harmonic terms fit; None for any number."""
        if self.memory is None:
            return None
        return max(FEWEST, (self.memory - FOR_ALL) // bytes_each(num_terms))

    def is_below(self, files: "Sequence[SceneFile]") -> bool:
        """Whether a scene takes more; strokes, and a moment of a moving scene, never do."""
        if all(file.is_strokes for file in files) or any(file.moment is not None for file in files):
            return False
        capacity = self.capacity(_most_terms(files))
        return capacity is not None and _num_rows(files) > capacity

    def words(self, files: "Sequence[SceneFile]") -> str:
        """How much too large a scene is."""
        assert self.memory is not None, "everything fits"
        size = FOR_ALL + _num_rows(files) * bytes_each(_most_terms(files))
        return f"strokes of them take {memory_words(size)} of memory, {memory_words(self.memory)} may be used"

    def num_processes(self) -> int:
        """Processes of this machine that read blocks where nobody asks for a number."""
        most = MOST_PROCESSES if self.memory is None else max(1, self.memory // 4 // FOR_PROCESS)
        return min(num_threads_or_default(None), MOST_PROCESSES, most)


def bytes_each(num_terms: int) -> int:
    """Memory that strokes of a scene take for each Gaussian of so many spherical-harmonic terms."""
    return FOR_EACH + FOR_EACH_TERM * (num_terms - 1)


def _num_rows(files: "Sequence[SceneFile]") -> int:
    return sum(file.num_rows for file in files)


def _most_terms(files: "Sequence[SceneFile]") -> int:
    return max(file.num_terms for file in files)
