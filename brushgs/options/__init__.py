"""Options of a run: choices, presets, and one frozen class per step."""
