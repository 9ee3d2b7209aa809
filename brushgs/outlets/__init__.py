"""Outputs built on paintings: pages, 3D models, the studio, sheets, learned styles, stroke files."""
