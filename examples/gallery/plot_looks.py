"""
Looks
=====

One scene in three looks. A look sets brushes, number of strokes, colors,
ground, stage, light and medium.
"""

# sphinx_gallery_thumbnail_number = 2

import brushgs as bg
from brushgs.still_life import still_life

scene = still_life(8000)
view = {"azimuth": 5, "elevation": 10, "fov_deg": 30, "size": "360x270", "strokes": 2000}
picture = [bg.paint(scene, look, **view) for look in ("gouache", "watercolour", "charcoal")]

# %%
# Each part of a look is a keyword, which changes that part alone.

picture = bg.paint(scene, "charcoal", ground="#d8b48c", **view)
