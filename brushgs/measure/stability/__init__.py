"""The temporal report: how still the strokes of a moving picture hold, and what that costs.

The protocol, in full, so that others can repeat it:

1. **The path.** n views of one size. A closed path ends with its first view once more; that view is a frame
   like any other. An orbit of 120 has 121 frames here, 120 steps of 3 degrees.
2. **The strokes.** The scene is pruned and clustered once, by the rule asked for; all configurations but two
   paint these same strokes with one stroke image, on one ground:
   - `track`: directions followed along the path; the filter, extent and order asked for (mip, fitted and
     soft); strokes fade instead of appearing and vanishing (`project(fade=True)`, as `render` does);
   - `anchor`: the same, with directions that each view finds by itself;
   - `off`: the same, with the directions of the projected ellipses, as published;
   - `published`: off, bilinear filter, boxes of 2 standard deviations, by depth, no fading (extents are not
     rounded to whole pixels, which the published code does: that defect would come on top);
   - `image`: the painterly filter of `image_strokes` on each plain picture alone, with as many strokes as the
     scene has, equal seed in each frame;
   - `plain`: the whole scene as loaded, with the kernel it was trained for. It gives depth and alpha.
3. **Directions**, from the boxes of every frame, painted or not, by `box_events.orientation_events`: flips,
   spins, size pops, kinks, strokes that vanish, each counted, and as a share of the stroke-frames weighted by
   painted area; the largest step of any direction; the share of slender strokes more than 10 degrees off both
   axes of their ellipse (`off_axis_share`); the largest shortfall of a box that does not cover its ellipse
   (`worst_shortfall`, as a share of its reach). Plain and image have no strokes that last.
4. **Flicker.** Pairs of frames (k, k + g) at the gaps g = 1, 7, 10. At most `pairs` pairs of a gap are
   compared: k = 0, s, 2 s, ... with the stride s = ceil((n - 1) / pairs). For each pair the earlier picture
   is moved to the later view by plain depth and pose (`warp.match_views`: which pixels are valid, and how
   they are read) and compared over valid pixels and three channels, on the ground. A figure is the mean over
   those pairs that have valid pixels: RMSE, RMSE over the worst 1 % of pixels, share of valid pixels.
   **Excess** is the error less that of the plain render over the same pair, then the mean over the pairs.
   A painting that differs little from the plain picture cannot flicker much, however it is made. So beside
   it: the **marks**, the painting less the plain picture of the same view, their RMS over valid pixels, and
   the part of them that does not move along, sqrt(sum |B - A|^2 / sum (|A|^2 + |B|^2)) with A the marks of
   the earlier frame moved to the later view and B those of the later one: 0 for marks that stick to the
   scene, 1 for marks that are new in each frame.
5. **Where strokes turn.** At gap 1, the error where the eye sees it: a pixel of the later view weighs as much
   as the share of its paint that belongs to strokes whose unlocked direction turns by more than 15 degrees
   between the two frames (a picture drawn as `off` with such strokes white and all others black). RMSE over
   the valid pixels of all pairs with these weights; excess as above.
6. **Loop.** On a closed path, the last picture against the first: RMSE and the largest difference.
7. **Independence.** `alone` frames, spread over those painted, are drawn again after the sequence, last
   first, in one thread, with directions followed anew: how many have the same bytes, colour and alpha.
8. **Seconds** per frame, wall clock: following the path over its frames; projecting and drawing over the
   frames that were painted. `image` has its own work alone; the plain picture that it starts from comes on
   top.

Frames are painted only where a pair, the loop or a second drawing needs them, and kept no longer than the
widest gap (the first one to the end of a loop). Values are display-encoded, 0 to 1; nothing is quantised.
"""

from brushgs.measure.stability.figures import Figures, Stability, Warp
from brushgs.measure.stability.measure import measure_stability
from brushgs.measure.stability.painters import Comparison
from brushgs.measure.stability.run import StabilityReport, report_stability

__all__ = [
    "Comparison",
    "Figures",
    "Stability",
    "StabilityReport",
    "Warp",
    "measure_stability",
    "report_stability",
]
