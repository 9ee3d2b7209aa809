"""The compiled core, and its machine layer: threads, processes, memory and stop signals."""
