"""Maps of strokes in one view, for hatching: tone, direction, normal and depth of every pixel.

All are drawn as soft pictures of the strokes, not of the scene: so marks follow every change of strokes, in
color, light or direction, and lie on the surface that hides lines.
"""

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import ndimage

from brushgs.brushes.texture import StrokeTexture
from brushgs.rendering.nested import scale_of
from brushgs.rendering.options import RenderOptions, project_with, rasterize_with
from brushgs.rendering.tonal import Tones
from brushgs.values.arrays import F32, F64, Array, Mask
from brushgs.values.boxes import Boxes
from brushgs.values.camera import Camera
from brushgs.values.frame import Frame
from brushgs.values.gaussians import Gaussians
from brushgs.values.sh import in_colors

SOLID = 0.5  # minimum alpha of a pixel that shows a surface
SMOOTH = 5.0  # px in a picture of `PIXELS`: standard deviation over which directions are averaged
BROAD, COARSE = 28.0, 4  # px, the same for a broader average of equal weight; stride of its computation
SMOOTH_NORMALS = 3.0  # the same for normals
BEHIND = 0.02  # of the depth: points at most this far behind a surface count as on it
FLATTEST = 0.15  # cosine between normal and view: surfaces seen from the side count as if at this angle


@dataclass(frozen=True, eq=False)
class TonalView:
    """Maps of a view.

    Attributes:
        camera: the view.
        tones: of the pixels, with coverage and jumps of depth.
        depth: [H, W] world units; infinite where there is no surface.
        directions: [H, W, 2] cosine and sine of twice the angle of marks, times any weight.
        normals: [H, W, 3] of the surface, camera axes, toward the camera.
    """

    camera: Camera
    tones: Tones
    depth: F32
    directions: F32
    normals: F32

    @classmethod
    def of(
        cls,
        strokes: Gaussians,
        tones: F64,
        axes: F64,
        normals: F64,
        camera: Camera,
        *,
        num_threads: int | None = None,
    ) -> "TonalView":
        """The maps of strokes.

        Args:
            strokes: n.
            tones: [n] 0 (black) to 1 (white).
            axes: [n, 3] see `mark_axes`.
            normals: [n, 3] unit normals.
            camera: the view.
            num_threads: None takes the processors available to this process.
        """
        kernel = StrokeTexture.open("gaussian")
        options = RenderOptions.of(kernel, num_threads=num_threads)
        boxes, _ = project_with(in_colors(strokes, np.repeat(tones[:, None], 3, axis=1)), camera, options)

        def drawn(colors: Array) -> Frame:
            shown = replace(boxes, colors=colors.astype(boxes.colors.dtype))
            return rasterize_with(shown, camera, kernel, options)

        frame = drawn(boxes.colors)
        assert frame.depth is not None, "it is drawn with depth"
        scale = scale_of(camera)
        depth = np.where(frame.alpha > SOLID, frame.depth, np.inf).astype(np.float32)
        return cls(
            camera,
            Tones.of(frame.rgb, frame.alpha, depth, scale),
            depth,
            _directions(boxes, axes, camera, drawn),
            _normals(boxes, normals, camera, drawn),
        )

    @property
    def focal(self) -> float:
        """Focal length, pixels."""
        return float(np.sqrt(self.camera.K[0, 0] * self.camera.K[1, 1]))

    def rays(self, pixels: F64) -> F64:
        """[P, 3] rays through pixels [P, 2], camera axes, z = 1."""
        rays = np.ones((len(pixels), 3))
        rays[:, :2] = (pixels - self.camera.K[:2, 2]) / np.diag(self.camera.K)[:2]
        return rays

    def lifted(self, pixels: F64, depths: F64) -> F64:
        """[P, 3] points in space at depths [P]."""
        camera = self.camera
        seen = self.rays(pixels) * depths[:, None]
        return np.asarray((seen - camera.viewmat[:3, 3]) @ camera.viewmat[:3, :3])

    def at(self, points: F64) -> tuple[F64, Mask]:
        """Pixels [P, 2] of points in space, and whether the view shows them."""
        camera = self.camera
        seen = points @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
        z = np.maximum(seen[:, 2], camera.near)
        with np.errstate(over="ignore"):
            pixels = seen[:, :2] / z[:, None] * np.diag(camera.K)[:2] + camera.K[:2, 2]
        is_seen = (seen[:, 2] > camera.near) & (pixels >= 0).all(axis=1)
        is_seen &= (pixels < (camera.width, camera.height)).all(axis=1)
        columns, rows = pixels[is_seen].astype(np.intp).T
        surface = self.depth[rows, columns]
        is_seen[is_seen] = np.isfinite(surface) & (z[is_seen] < surface * (1 + BEHIND))
        return pixels, is_seen

    def sizes(self, points: F64, normals: F64) -> F64:
        """[P] side of a square of unit area on a surface, in px of a picture of `PIXELS`."""
        camera = self.camera
        rays = points - camera.position
        lengths = np.maximum(np.linalg.norm(rays, axis=1), np.finfo(np.float64).tiny)
        cosines = np.abs((rays * normals).sum(axis=1)) / lengths
        z = np.maximum(points @ camera.viewmat[2, :3] + camera.viewmat[2, 3], camera.near)
        return np.asarray(self.focal / scale_of(camera) / z * np.sqrt(np.maximum(cosines, FLATTEST)))


Draw = Callable[[Array], Frame]


def _directions(boxes: Boxes, axes: F64, camera: Camera, drawn: Draw) -> F32:
    K = camera.K
    along = axes[boxes.ids] @ camera.viewmat[:3, :3].T
    rays = (boxes.centers.astype(np.float64) - K[:2, 2]) / np.diag(K)[:2]
    # The picture of a short piece of the axis at the center of the box.
    x, y = ((along[:, :2] - rays * along[:, 2:]) * np.diag(K)[:2] / np.sqrt(K[0, 0] * K[1, 1])).T
    pairs = np.stack([x * x - y * y, 2 * x * y, np.zeros(len(x))], axis=1)
    frame, scale = drawn(np.clip(0.5 + 0.5 * pairs, 0, 1)), scale_of(camera)
    near = _smoothed(frame, SMOOTH * scale)[..., :2]
    coarse = ndimage.gaussian_filter(
        near[::COARSE, ::COARSE], (*2 * (BROAD * scale / COARSE,), 0), truncate=2.5
    )
    broad = coarse.repeat(COARSE, axis=0).repeat(COARSE, axis=1)[: camera.height, : camera.width]
    return np.ascontiguousarray(near + broad)


def _normals(boxes: Boxes, normals: F64, camera: Camera, drawn: Draw) -> F32:
    facing = normals[boxes.ids] @ camera.viewmat[:3, :3].T
    rays = np.ones_like(facing)
    rays[:, :2] = (boxes.centers.astype(np.float64) - camera.K[:2, 2]) / np.diag(camera.K)[:2]
    facing *= np.where((facing * rays).sum(axis=1, keepdims=True) > 0, -1.0, 1.0)
    field = _smoothed(drawn(0.5 + 0.5 * facing), SMOOTH_NORMALS * scale_of(camera))
    lengths = np.linalg.norm(field, axis=2, keepdims=True)
    return np.asarray(np.where(lengths > 0.1, field / np.maximum(lengths, 1e-6), (0, 0, -1)), np.float32)


def _smoothed(frame: Frame, deviation: float) -> F32:
    """[H, W, 3] values that the colors of a frame encode, from -1 to 1, averaged."""
    field = 2 * frame.rgb - frame.alpha[..., None]
    return np.asarray(ndimage.gaussian_filter(field, (deviation, deviation, 0), truncate=2.5), np.float32)
