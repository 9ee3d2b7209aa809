"""
Strokes that hold still
=======================

Frames of a camera that moves. Strokes keep their place and direction; `save_video` writes
such frames as a film.
"""

import numpy as np

import brushgs as bg
from brushgs.still_life import still_life, still_life_camera

strokes = bg.cluster(still_life(12_000), 1500, seed=0)
x, y, z = still_life_camera(width=360, height=270).position
cameras = [
    bg.Camera.look_at((x + step, y, z), (0, -1.2, 0), width=360, height=270, fov_y=np.radians(26))
    for step in np.linspace(-2.5, 1.5, 25)  # world units, to both sides
]
frames = list(bg.render_sequence(strokes, cameras, "flat", underpaint=True))
picture = frames[::12]
