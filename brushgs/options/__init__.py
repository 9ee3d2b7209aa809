"""What a run is asked to do: words, presets, and one frozen dataclass per step. Only the standard library is imported."""
