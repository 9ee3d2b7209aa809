"""
Strokes step by step
====================

Prune, cluster, project, paint. Strokes in space are Gaussians too.
"""

# sphinx_gallery_thumbnail_number = 4

import brushgs as bg
from brushgs.still_life import still_life, still_life_camera

gaussians = bg.prune(still_life(12_000), keep=0.7)
camera = still_life_camera(width=400, height=300)
few, more, many = (bg.cluster(gaussians, count, seed=0) for count in (200, 1000, 4000))
picture = [bg.render(strokes, camera, "flat") for strokes in (few, more, many)]

# %%
# The same thousand strokes with other brushes. Any picture with transparency is one. The underpaint fills
# what they leave.

picture = [bg.render(more, camera, name, underpaint=True) for name in ("dry_brush", "swirl", "dab")]
