"""The scene file and the empty folder of the tests of commands."""

from tests.kit.commands import folder, scene  # noqa: F401
