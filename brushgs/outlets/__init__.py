"""Outputs built on paintings: pages, 3D models, the studio, sheets, learnt styles, stroke files."""
