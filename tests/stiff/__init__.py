"""Stiff and extreme scenes; `scenes.py` is the list of them, each with its outcome.

Outcomes: "drawn" rightly, "dropped" and counted, "refused" by name. Wherever it is drawn, no value is NaN
or infinite, in float32 and float64, for every lock, order and filter (`test_pictures.py`,
`test_passes.py`), and boxes are right to 1e-4 against extended precision (`test_boxes.py`). Nothing here
can hang: scenes are small, and what is large on purpose (rows, pixels, repetitions) is bounded by its size.

Bounds, as measured: boxes of float64 scenes 1e-12 up to an aspect ratio of 1e8 and 2e-8 at 1e12; boxes of
float32 scenes half a unit in the last place at any aspect ratio, distance or size, as geometry is float64
inside; pictures of float32 scenes 5e-6 off those of float64 in the mean. Not sound: coordinates beyond
1e150 in float64, whose squares overflow; in float32 the order of strokes whose depths agree to seven digits.
Slow: the soft order compares all faint strokes within their softness (1000 that fill 400 x 400 pixels at
opacity 0.02 take 5 s of processor time, and four times as many sixteen times as long).
"""
