"""Pages: what the help of the command line needs. Without `dataclasses`, see `choices`."""

PAGE_SUFFIXES = (".html",)
# Of a page, from where on devices suffer; see `brushgs.outlets.page.weight`.
PHONE_BYTES, PHONE_FRAGMENTS = 8_000_000, 24.0
HEADSET_FRAGMENTS = 6.0
QUAD_SUFFIXES = (".glb",)  # of textured rectangles for 3D programs, see `brushgs.outlets.glb`
