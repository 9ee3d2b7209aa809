"""Writes swirl.png: the whole Python API in ten lines, from Gaussians to a picture.

python examples/ten_lines.py [FOLDER]
"""

import sys
from pathlib import Path

import brushgs as bg
from brushgs.still_life import still_life, still_life_camera

folder = Path(sys.argv[1] if len(sys.argv) > 1 else ".")
gaussians = still_life()  # or bg.load("scene.ply")
camera = still_life_camera(width=800, height=600)  # or bg.load_cameras("cameras.json")[12]
gaussians = bg.prune(gaussians, keep=0.7)
strokes = bg.cluster(gaussians, 5000, seed=0)
texture = bg.StrokeTexture.open("swirl")  # or an image of your own
frame = bg.render(strokes, camera, texture)
bg.save(strokes, folder / "strokes.ply")
bg.save(frame, folder / "swirl.png")  # transparent where nothing is painted
print(f"{len(strokes)} strokes in {folder / 'swirl.png'}")
