"""Styles: learned from paintings and from edits, and applied to the strokes of any scene."""
