"""The bench: curves of error against run time, for one scene in one view.

The protocol, in full, so that others can repeat it:

1. **Families.** In each one choice varies, and all else is as `brushgs render` has it:
   - `strokes`: their number, up to one per Gaussian that is kept. Against the **plain picture**, the whole
     scene as loaded with the kernel it was trained for. Seconds of a frame (project and rasterise) and of a
     whole painting (load the file, prune, cluster, project, rasterise);
   - `merge`: "cover" and "paper", by "auto" and (unless quick) "minibatch" k-means, of "balanced" and
     "paper" features. Against the plain picture; seconds of clustering and merging;
   - `filter`: how a stroke image is read. Against 8 x 8 bilinear samples a pixel; seconds of a frame;
   - `precision`: float32 and float64, and the light at which a pixel is finished (`min_transmittance`).
     Against the float64 definition (`brushgs.rendering.reference`) that finishes none, at full size with the
     strokes below, in soft order at a quarter of it; seconds of a frame;
   - `sh`: spherical harmonics up to each degree, of the whole scene with its own kernel. Against all that
     the scene uses; seconds of that frame;
   - `size`: the picture painted smaller or larger and brought to the size asked for, linearly. Against one
     of twice the size; seconds of a frame.
   All but the first and `sh` paint one count of strokes: 2,000 (250 if quick), or the count of the list that
   is next to it. A family that a scene has no use for is left out, with the reason.
2. **Error.** Of the picture on its ground, clipped to 0 to 1, not quantised: RMSE and PSNR over pixels and
   channels, and the largest difference. Against the plain picture also SSIM, FLIP and the share of its alpha
   left unpainted; see `brushgs.measure.likeness`.
3. **Verified before it is timed.** Of each picture a square of 32 x 32 pixels, where most strokes lie, is
   painted by the float64 definition from the strokes as they lie in space, and held to it: to 2e-5 on average
   but for at most 0.2 % of the pixels, off by more than 1/255 (float32), or to 1e-9 (float64). The plain
   picture and, on a smaller square, the supersampled one are verified the same way. Every run that is timed
   must give what was verified, bit for bit; a whole painting, too. What fails ends the bench with its name.
4. **Seconds.** Wall clock. All points of a family run in turns, `repeats` rounds of them: a machine that
   slows down slows them all. What takes less than 0.1 s runs three times in a round, what takes more than 2
   s in three rounds at most. A point tells the median, the quartiles and how many runs there were.
5. **Pareto front.** The points of a family that no other beats in RMSE and median seconds both.
6. **Advice.** The knee of the curve of `strokes` by the seconds of a frame, see `brushgs.stroke_count.curve`.
"""

from brushgs.measure.bench.run import BenchReport, report_bench

__all__ = ["BenchReport", "report_bench"]
