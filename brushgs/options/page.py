"""Constants of splat pages that `--help` needs; see `choices`."""

PAGE_SUFFIXES = (".html",)
# Page weights above which devices get slow; see `brushgs.outlets.page.weight`.
PHONE_BYTES, PHONE_FRAGMENTS = 8_000_000, 24.0
HEADSET_FRAGMENTS = 6.0
UNDERPAINT_STEP = 4  # pixels of a moving picture along one of its layer of underpaint
QUAD_SUFFIXES = (".glb",)  # textured rectangles for 3D programs, see `brushgs.outlets.glb`
