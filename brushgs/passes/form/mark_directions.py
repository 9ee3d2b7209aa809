"""Stroke directions of a painting: those of its brush marks at the strokes' positions in the first picture.

The painting is laid over the picture of the camera, scaled to fill it and cropped to its center, like a
background. So one portrait can guide another, and a sky with swirls makes swirls in the sky. Directions are
taken once, for one camera, and stay with the strokes in space. Marks run where brightness changes least:
along the smaller eigenvector of the structure tensor.
Source: Bigun and Granlund 1987, Optimal orientation detection of linear symmetry.
"""

from dataclasses import dataclass

import numpy as np

from brushgs.passes.form.planes import Planes, Wish, pairs_of, ramp, unit_pairs
from brushgs.values.arrays import F64, Array, check
from brushgs.values.camera import Camera
from brushgs.values.colors import LUMINANCE, flatten, split_alpha

MOST_SIDE = 512  # pixels of a painting; larger ones are averaged, since marks are wider than bristles
LEAST_SIDE = 8  # pixels
FINE = 1.0  # pixels, standard deviation of the smoothing before slopes are taken
COARSE = 0.02  # of the shorter side: standard deviation of the area for comparing slopes, about a mark
FLAT = 0.1  # of the mean energy of slopes: areas with less have no marks
CLEAR = (0.05, 0.35)  # range of coherence over which marks gain weight
FACING = (0.1, 0.4)  # cosine between a stroke's normal and the view: seen edge-on it has no direction


@dataclass(frozen=True, eq=False)
class Marks:
    """The marks of a painting that lies over the picture of a camera.

    Attributes:
        camera: takes the picture.
        pairs: [h, w, 2] twice the angles of marks from +x toward +y, see `planes`; weight 0 to 1.
        aspect: maximum length over width of strokes along the marks; None for the usual one.
    """

    camera: Camera
    pairs: F64
    aspect: float | None = None

    @property
    def clearest(self) -> float:
        """The largest weight, 0 to 1."""
        return float(np.hypot(self.pairs[..., 0], self.pairs[..., 1]).max())

    @classmethod
    def of_image(cls, image: Array, camera: Camera) -> "Marks":
        """The marks of a picture [H, W, C] as `read_image` returns it.

        Raises:
            TypeError: if `image` is not an array.
            ValueError: if it has other channels, is smaller than 8 x 8 pixels, or shows no marks.
        """
        return cls(camera, marks_in("Marks", image, LEAST_SIDE))


def mark_wish(marks: Marks, planes: Planes) -> Wish:
    """The directions of strokes by the marks of a painting.

    A stroke takes the direction whose projection is that of the mark at its center, even if it is hidden or
    faces away: the painting passes through the scene like the light of a projector. Strokes outside the
    picture, behind the camera or seen edge-on get none.
    """
    camera = marks.camera
    x, y, z = (planes.means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]).T
    is_ahead = z > camera.near
    depths = np.where(is_ahead, z, 1.0)
    fx, fy, cx, cy = camera.K[0, 0], camera.K[1, 1], camera.K[0, 2], camera.K[1, 2]
    columns, rows = fx * x / depths + cx, fy * y / depths + cy
    is_inside = is_ahead & (columns >= 0) & (columns < camera.width) & (rows >= 0) & (rows < camera.height)
    found = np.zeros((len(planes), 2))
    found[is_inside] = marks_at(marks, columns[is_inside], rows[is_inside])
    directions, clear = unit_pairs(found)
    angles = 0.5 * np.arctan2(directions[:, 1], directions[:, 0])

    # Projected axes of the plane, in pixels times depth; then the vector in the plane with this projection.
    axes = planes.axes @ camera.viewmat[:3, :3].T  # [n, 3, 3] in the frame of the camera
    seen_x = fx * (axes[:, :2, 0] - (x / depths)[:, None] * axes[:, :2, 2])
    seen_y = fy * (axes[:, :2, 1] - (y / depths)[:, None] * axes[:, :2, 2])
    cosines, sines = np.cos(angles), np.sin(angles)
    vectors = np.stack(
        [
            seen_y[:, 1] * cosines - seen_x[:, 1] * sines,
            seen_x[:, 0] * sines - seen_y[:, 0] * cosines,
        ],
        axis=1,
    )
    view = np.stack([x, y, depths], axis=1)
    facing = np.abs(np.einsum("ni,ni->n", axes[:, 2], view)) / np.linalg.norm(view, axis=1)
    say = np.where(is_inside, clear * ramp(facing, *FACING), 0.0)
    pairs = unit_pairs(pairs_of(vectors))[0]
    return Wish(say[:, None] * pairs, np.zeros((len(planes), 3)))


def marks_at(marks: Marks, columns: F64, rows: F64) -> F64:
    """The pairs [n, 2] at positions in the picture, pixels, interpolated in the painting."""
    height, width = marks.pairs.shape[:2]
    camera = marks.camera
    scale = max(camera.width / width, camera.height / height)  # fills the picture
    u = np.clip((columns - camera.width / 2) / scale + width / 2 - 0.5, 0, width - 1.001)
    v = np.clip((rows - camera.height / 2) / scale + height / 2 - 0.5, 0, height - 1.001)
    j, i = u.astype(np.intp), v.astype(np.intp)
    right, below = (u - j)[:, None], (v - i)[:, None]
    upper = (1 - right) * marks.pairs[i, j] + right * marks.pairs[i, j + 1]
    lower = (1 - right) * marks.pairs[i + 1, j] + right * marks.pairs[i + 1, j + 1]
    return np.asarray((1 - below) * upper + below * lower)


def marks_in(where: str, image: Array, least_side: int) -> F64:
    """The directions of the marks in a picture [H, W, C], [h, w, 2] as `Marks.pairs`.

    Args:
        where: name of the caller, for messages.
        image: as `read_image` returns it.
        least_side: pixels.

    Raises:
        TypeError: if `image` is not an array.
        ValueError: if it has other channels than 1 to 4, a smaller side, or shows no marks.
    """
    sizes = check(where, image=(image, "H W C"))
    if not 1 <= sizes["C"] <= 4 or min(sizes["H"], sizes["W"]) < least_side:
        raise ValueError(
            f"{where}: image must have 1 to 4 channels and {least_side}x{least_side} pixels or more, got "
            f"{sizes['C']} in {sizes['W']}x{sizes['H']}"
        )
    pairs = mark_pairs(*shrunk(image))
    if not pairs.any():
        raise ValueError(f"{where}: image must show marks, got one even color")
    return pairs


def shrunk(image: Array) -> tuple[F64, F64]:
    """Brightness and alpha [h, w] of a picture, averaged over whole blocks until it is small."""
    step = -(-max(image.shape[:2]) // MOST_SIDE)
    height, width = max(image.shape[0] // step, 1), max(image.shape[1] // step, 1)
    brightness, covered = np.empty((2, height, width))
    for row in range(height):  # row by row: whole copies of a large picture would take much memory
        block = image[row * step : (row + 1) * step, : width * step].astype(np.float64)
        alpha = split_alpha(block)[1]
        light = flatten(block) @ np.array(LUMINANCE)
        brightness[row] = light.reshape(len(block), width, -1).mean(axis=(0, 2))
        if alpha is not None:
            covered[row] = alpha.reshape(len(block), width, -1).mean(axis=(0, 2))
    if split_alpha(image[:1, :1])[1] is None:
        covered[:] = 1
    return brightness, covered


def mark_pairs(brightness: F64, covered: F64) -> F64:
    """Directions of least change, [h, w, 2]."""
    from scipy.ndimage import gaussian_filter

    slope_y, slope_x = np.gradient(gaussian_filter(brightness, FINE))
    coarse = COARSE * min(brightness.shape)
    xx, xy, yy = (
        gaussian_filter(product, coarse)
        for product in (slope_x * slope_x, slope_x * slope_y, slope_y * slope_y)
    )
    energy = xx + yy
    floor = FLAT * float(energy.mean())
    if not floor > np.finfo(np.float64).eps:  # the rounding of a picture of one color
        return np.zeros((*brightness.shape, 2))
    pairs = np.stack([yy - xx, -2 * xy], axis=-1)
    lengths = np.hypot(pairs[..., 0], pairs[..., 1])
    clear = ramp(lengths / (energy + floor), *CLEAR) * covered
    return np.asarray(pairs * (clear / np.where(lengths > 0, lengths, 1.0))[..., None])
