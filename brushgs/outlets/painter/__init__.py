"""A page that paints scene files which are dropped on it, by the core compiled to WebAssembly."""
