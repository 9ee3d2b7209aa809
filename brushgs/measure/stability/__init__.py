"""The temporal report: stability of the strokes of a moving picture, and its cost.

The complete protocol:

1. **Path.** Frames of one size. On a loop the first frame is painted once more at the end, so that the last
   step is measured too: an orbit of 120 frames has 120 steps of 3 degrees. In the JSON and below n counts
   that one as well (121).
2. **Strokes.** The scene is pruned and clustered once, as configured; all configurations except `plain` paint
   these strokes with one stroke image on one background:
   - `track`: directions tracked along the path; filter, extent and order as configured (default: mip, fitted
     and soft); strokes fade instead of appearing and vanishing (`project(fade=True)`, as `render` does);
   - `anchor`: the same, with directions chosen in each view alone;
   - `off`: the same, with the directions of the projected ellipses, as published;
   - `published`: off, bilinear filter, boxes of 2 standard deviations, by depth, no fading (extents are not
     rounded to whole pixels as in the published code: that would add a defect of its own);
   - `plain`: the whole scene as loaded, with the kernel it was trained with. It gives depth and alpha.
   - `hand`, for hand-made films (`--hold`, `--boil`, `--redraw`, `--smear`): `track` with its drawings. The
     directions of step 3 are those before drawings change them: they show only unrequested turns. A drawing
     held for n frames turns by the turn of n frames.
   For a moving scene the strokes are made once and followed, and `published` is replaced by
   - `alone`: strokes made of each moment alone, with the same options, and drawn as a still: with their
     fields of directions (`--lock canonical`). Mutually nearest strokes of consecutive frames count as one.
3. **Directions**, from the boxes of every frame, painted or not, by `box_events.orientation_events`: flips,
   spins, size pops, kinks and strokes that vanish, each as a count and as a share of the stroke-frames
   weighted by painted area; the largest step of any direction; the share of slender strokes more than 10
   degrees off both axes of their ellipse (`off_axis_share`); the largest shortfall of a box that does not
   cover its ellipse, as a share of its reach (`worst_shortfall`). Only strokes in space have these figures.
4. **Flicker.** Pairs of frames (k, k + g) at the gaps g = 1, 7, 10. At most `pairs` pairs per gap are
   compared: k = 0, s, 2 s, ... with the stride s = ceil((n - 1) / pairs). For hand-made films the stride is
   the next one without a common divisor with holds and `--boil-every`; otherwise all pairs could start with a
   new drawing and lie within it. For each pair the earlier picture is moved to the later view by plain depth
   and pose (`warp.match_views` defines the valid pixels and the sampling) and compared over valid pixels and
   three channels, on the background. A figure is the mean over the pairs that have valid pixels: RMSE, RMSE
   over the worst 1 % of pixels, share of valid pixels.
   For moving scenes, each pixel of the later view is moved by the displacement of the Gaussians that paint it
   before it is looked up (`flow.displacements`), so rows of the scene must correspond.
   **Excess** is the error minus that of the plain picture for the same pair, then the mean over the pairs.
   A painting that differs little from the plain picture cannot flicker much, however it is made. Therefore
   the report also has the **marks**, the painting minus the plain picture of the same view: their RMS over
   valid pixels, and the part of them that does not move with the scene, sqrt(sum |B - A|^2 / sum (|A|^2 +
   |B|^2)) with A the marks of the earlier frame moved to the later view and B those of the later one: 0 for
   marks that stick to the scene, 1 for marks that are new in each frame.
5. **Where strokes turn.** At gap 1, the error in the places where directions are unstable: a pixel of the
   later view is weighted by the share of its paint that belongs to strokes whose unlocked direction turns by
   more than 15 degrees between the two frames (drawn as `off`, such strokes white and all others black). RMSE
   over the valid pixels of all pairs with these weights; excess as above.
6. **Loop.** On a closed path, the last picture against the first: RMSE and the largest difference.
7. **Independence.** `alone` frames, distributed evenly over those painted, are painted again after the
   sequence, last first, in one thread, with directions tracked anew: how many have the same bytes, color and
   alpha.
8. **Animation**, from the boxes of every frame and the exact flow of the scene in every step: flatness,
   motion coherence and temporal continuity, as `marks.MarkMeter` defines them.
9. **Pictures**: SSIM to the plain picture and UIQM (`likeness.ssim`, `uiqm.uiqm`), the means over at most 12
   of the painted frames. Codes for UIQM differ: compare with other figures of this report only.
10. **Seconds** per frame, wall clock: tracking, over the frames of the path; projecting and drawing, over the
   frames that were painted.

**Looks.** A painting in a look (`--look oil`) has ground, light, a stage or several coats. Then `track`,
`anchor` and `off` paint whole frames, as `brushgs render` does, and differ only in the lock of their coats;
`alone` paints each moment as a still; nothing is called `published`. Steps 3 and 8 refer to the strokes of
the scene, the largest tracked coat except a backdrop. The plain picture has the mean color of the ground as
background. The drawing time of a frame includes projection.

The plain picture is drawn for every frame. A frame is painted only if a pair, the loop or a second painting
needs it, and kept no longer than the widest gap (the first one until the end of a loop). Values are
display-encoded, 0 to 1; nothing is quantized.
"""

from brushgs.measure.stability.figures import Figures, Stability, Warp
from brushgs.measure.stability.measure import measure_stability
from brushgs.measure.stability.painters import Comparison, Painter, PaintTimer
from brushgs.measure.stability.run import StabilityReport, report_stability

__all__ = [
    "Comparison",
    "Figures",
    "PaintTimer",
    "Painter",
    "Stability",
    "StabilityReport",
    "Warp",
    "measure_stability",
    "report_stability",
]
