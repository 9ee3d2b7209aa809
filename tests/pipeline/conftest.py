"""Fixtures of this folder."""

from tests.kit.commands import folder, scene  # noqa: F401
