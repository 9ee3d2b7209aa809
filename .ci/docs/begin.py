import numpy as np

import brushgs as bg
from brushgs.still_life import still_life, still_life_camera

gaussians = still_life(4000)  # or bg.load("scene.ply")
camera = still_life_camera(width=320, height=240)  # or bg.frame_scene(gaussians)
strokes = bg.cluster(gaussians, 500)
