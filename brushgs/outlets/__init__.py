"""What stands on a painting: pages, 3D models, the studio, sheets, styles learnt, files of strokes."""
