"""What is fixed of a style file.

    {
      "brushgs": "style", "version": 1, "name": "monet",
      "palette": [{"name": "deep blue", "color": "#1f3a6b", "share": 0.31, "offsets": ARRAY [m, 3]}, ...],
      "marks": {"length": 0.04, "aspect": 4.1, "broken_lightness": 0.02, "broken_chroma": 0.01,
                "ground": "#8a5420", "relief": 0.4, "directions": ARRAY [h, w, 2], "brushes": [PNG, ...]},
      "edit": {"affine": [[1, 0, 0, 0], ...], "log_size": 0, "residual": {...}}
    }

Of palette, marks and edit at least one is there. The fields are those of `Style`. An
array is a list, of lists, of numbers, or packed: {"type": "float16", "shape": [128, 3], "data": base64},
little endian, where int8 stands for -1 to 1 in steps of 1/127 and uint8 for 0 to 1 in steps of 1/255. A
picture is {"type": "png", "data": base64}, 8 bits of grey. What an artist may write too: shares that do not
add up to 1 (they are scaled so that they do), and a colour without offsets (it alone).
"""

MARK, VERSION = "style", 1
MAX_BYTES = 200_000
MAX_NAME = 80  # characters
MAX_COLORS, MAX_BRUSHES = 64, 64
MAX_TEXELS = 256  # a side of a brush, and of the field of directions
CURE = "give a file that `brushgs style learn` wrote"
