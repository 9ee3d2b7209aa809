"""What a run is asked to do: words, presets, one frozen dataclass per step. Standard library only."""
