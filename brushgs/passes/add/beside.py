"""The lightness of a subject beside the strokes of a stage, for counterchange."""

from collections.abc import Sequence

import numpy as np
from scipy import ndimage

from brushgs.brushes.texture import StrokeTexture
from brushgs.passes.seen import some_small
from brushgs.rendering.options import RenderOptions, render_with
from brushgs.values.arrays import F64
from brushgs.values.camera import Camera
from brushgs.values.gaussians import Gaussians

SIDE, MOST_VIEWS = 160, 3  # pixels, longer side of the examined views, and their maximum number
NEAR = 0.09  # deviation of the blur that decides which strokes are beside the subject, share of that side
LIFTED = 3.0  # factor on the difference from the subject's middle tone
FULL = 2.0  # factor on the blurred coverage around a stroke, relative to the highest


def beside(subject: Gaussians, strokes: Gaussians, cameras: Sequence[Camera]) -> F64:
    """How light a subject is beside other strokes, seen in some views.

    Args:
        subject: N strokes whose colors are tones, equal in all channels.
        strokes: n strokes of its stage.
        cameras: of the job.

    Returns:
        [n] from -1 beside its dark sides to 1 beside its light sides; 0 far from it, and for strokes that no
        view shows.
    """
    kernel = StrokeTexture.open("gaussian")
    total, count = np.zeros(len(strokes)), np.zeros(len(strokes))
    for camera in some_small(cameras, MOST_VIEWS, SIDE):
        frame = render_with(subject, camera, kernel, RenderOptions.of(kernel))
        light, near = (
            ndimage.gaussian_filter(plane.astype(np.float64), NEAR * max(plane.shape), mode="constant")
            for plane in (frame.rgb[..., 0], frame.alpha)
        )
        middle = light.sum() / max(near.sum(), 1e-12)
        values = np.clip(LIFTED * (light / np.maximum(near, 1e-6) - middle), -1, 1)
        values *= np.clip(FULL * near / max(float(near.max()), 1e-12), 0, 1)
        places = strokes.means @ camera.viewmat[:3, :3].T + camera.viewmat[:3, 3]
        depths = np.maximum(places[:, 2:], camera.near)
        columns, rows = (places[:, :2] / depths * np.diag(camera.K)[:2] + camera.K[:2, 2]).T
        seen = (places[:, 2] > camera.near) & (columns >= 0) & (rows >= 0)
        seen &= (columns < camera.width) & (rows < camera.height)
        total[seen] += values[rows[seen].astype(int), columns[seen].astype(int)]
        count += seen
    return np.asarray(total / np.maximum(count, 1))
