"""
Colors of another picture
=========================

The colors of a scene, moved towards those of a picture by mean and covariance. Here the
picture is a handful of evening colors; `Palette.of_image` takes any painting.
"""

# sphinx_gallery_thumbnail_number = 2

import numpy as np

import brushgs as bg
from brushgs.still_life import still_life, still_life_camera

gaussians = still_life(12_000)
camera = still_life_camera(width=400, height=300)
evening = np.array([[0.8, 0.55, 0.4], [0.6, 0.35, 0.3], [0.35, 0.25, 0.4], [0.2, 0.2, 0.36], [0.1, 0.1, 0.2]])
palette = bg.Palette.of_colors(evening)
scenes = [gaussians, bg.recolor(gaussians, palette, strength=0.7)]
picture = [bg.render(bg.cluster(scene, 3000, seed=0), camera, "flat", underpaint=True) for scene in scenes]
