"""
A scene, painted
================

The scene as it was captured, and in oil. `paint` does what `brushgs render` does,
with its flags as keywords.
"""

# sphinx_gallery_thumbnail_number = 2

import brushgs as bg
from brushgs.still_life import still_life

scene = still_life(12_000)  # or "scene.ply"
view = {"azimuth": 5, "elevation": 10, "fov_deg": 30, "size": "480x360"}
picture = bg.paint(scene, stroke="gaussian", **view)

# %%
# In oil, the default look: a ground, brushes by the size of the stroke, a lamp on the relief of the paint.

picture = bg.paint(scene, "oil", strokes=3000, **view)
