"""Cameras for scenes that come without one: framing, orbits, paths through key views."""
