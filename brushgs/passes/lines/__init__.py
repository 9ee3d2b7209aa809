"""The lines of a scene, as someone would draw them: see `find_lines`."""

from brushgs.passes.lines.find import Lines as Lines
from brushgs.passes.lines.find import find_lines as find_lines
