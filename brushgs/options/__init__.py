"""Options of a run: choices, presets, and one frozen dataclass per step. Standard library only."""
