"""The bench: curves of error against run time, for one scene in one view.

The complete protocol:

1. **Families.** In each family one choice varies, and everything else is as in `brushgs render`:
   - `strokes`: the number of strokes, up to one per Gaussian that pruning keeps. Against the **plain
     picture**, the whole scene as loaded with the kernel it was trained with. Seconds of a frame (project and
     rasterize) and of a whole painting (load the file, prune, cluster, project, rasterize). Beside this total
     error stands that of **clustering**: the same clusters drawn with the kernel of the plain picture. What
     remains of the total with one stroke per Gaussian is the error of the **brush**. **Held out** is the
     total error over four views between those that strokes are made for (`cameras.around.HELD_OUT`);
   - `merge`: "cover" and "paper", by "auto" and (unless quick) "minibatch" k-means, of "balanced" and "paper"
     features. Against the plain picture; seconds of clustering and merging;
   - `filter`: how a stroke image is sampled. Against 8 x 8 bilinear samples per pixel; seconds of a frame;
   - `precision`: float32 and float64, and the transmittance at which a pixel is finished
     (`min_transmittance`). Against the float64 definition (`brushgs.rendering.reference`) without an early
     stop, in soft order at a quarter of the size; seconds of a frame;
   - `sh`: spherical harmonics up to each degree, of the whole scene with its own kernel. Against the highest
     degree that the scene uses; seconds of that frame;
   - `size`: the picture painted smaller or larger and linearly resized to the configured size. Against one of
     twice the size; seconds of a frame.
   All families except `strokes` and `sh` paint one number of strokes: 2,000 (250 if quick), or the nearest
   number in the list. A family that does not apply to a scene is skipped, with the reason.
2. **Error.** Of the picture on its background, clipped to 0 to 1, not quantized: RMSE and PSNR over pixels
   and channels, and the largest difference. Against the plain picture also SSIM, FLIP and the share of its
   alpha left unpainted; see `brushgs.measure.likeness`.
3. **Verified before it is timed.** Of each picture a square of 32 x 32 pixels, where most strokes lie, is
   painted by the float64 definition from the strokes in space. The picture must agree with it to 2e-5 on
   average, except for at most 0.2 % of the pixels that may be off by more than 1/255 (float32), or to 1e-9
   (float64). The plain picture and, in a smaller square, the supersampled one are verified in the same way.
   Every timed run must give the verified picture, bit for bit, and so must a whole painting. The first
   failure stops the bench with the name of the point.
4. **Seconds.** Wall clock. All points of a family run alternately, in `repeats` rounds, so that a machine
   that slows down slows all of them. A run of less than 0.1 s is timed three times per round, one of more
   than 2 s in at most three rounds. A point has the median, the quartiles and the number of runs.
5. **Pareto front.** The points of a family that no other point beats in both RMSE and median seconds, for
   each measured time: for strokes one for a film, by the frame, and one for a still, by the painting. Times
   are equal if the quartiles of one lie between those of the other.
6. **Advice.** The knees of the curve of `strokes`, a film's and a still's: see `brushgs.stroke_count.curve`.
7. **Doubts.** Reported if other programs kept a tenth of a processor busy meanwhile (Linux), if the quartiles
   of half the points are more than a quarter of the median apart, and if the error of the last count is above
   the least.

**Looks.** A painting in a look (`--look oil`: ground, light, coats, stage) has no true picture: the plain one
has neither canvas nor lamp. It is compared with its own limit. Points are whole paintings, and step 1 is:

- `strokes`: the number of strokes, up to one per Gaussian. Against the same look at its limit: a stroke for
  each Gaussian, made by the usual views and twelve between them, with 3 x 3 samples per pixel. The rest with
  one stroke per Gaussian is the effect of samples and views. Seconds of a frame and of a whole painting.
  **Held out** compares both in the four views as above;
- `size`: as above, of whole paintings: the points above the configured size show the gain of supersampling;
- `views`: strokes made without views, by that of the picture, by those near it, and by the usual ones.
  Against the usual ones and twelve between them;
- `knobs`: each choice of a look changed alone (`bench.knobs`). Against the unchanged painting: the effect and
  the cost of a knob.

The last three paint as many strokes as the look has. The other families do not apply to a look. Step 3
becomes: the whole picture must agree in the same bounds with the same painting in float64, whose kernels are
compiled apart. There is one error, so both knees of step 6 refer to it. `views` and `knobs` are also
available for bare strokes.
"""

from brushgs.measure.bench.run import BenchReport, report_bench

__all__ = ["BenchReport", "report_bench"]
