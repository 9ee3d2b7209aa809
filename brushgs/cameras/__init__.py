"""Cameras for scenes that come without one: framing, orbits, and paths through key views."""
