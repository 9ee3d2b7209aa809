"""A small rasteriser of textured rectangles: what a viewer shows of a .glb file, in the order of indices.

It takes all it knows from the file. Colors are blended display-encoded, as paintings are; where a texture is
smaller than the pixels, alpha is the mean over several places of a pixel.
"""

import numpy as np
from scipy.ndimage import map_coordinates

SAMPLES = 3  # along each side of a pixel


def picture_of(glb, width, height):
    """[h, w, 4] premultiplied color and alpha, from the camera of the file."""
    rgba = np.zeros((height, width, 4))
    (node,) = [number for number, one in enumerate(glb.top["nodes"]) if "camera" in one]
    to_camera = np.linalg.inv(glb.world_matrices()[node])
    lens = glb.top["cameras"][glb.top["nodes"][node]["camera"]]["perspective"]
    half = np.tan(lens["yfov"] / 2) * np.array([lens["aspectRatio"], 1.0])
    texture = glb.image() / 255
    texture[..., :3] = _linear(texture[..., :3])
    for _, vertices, faces, uv, colors in glb.meshes():
        seen = vertices @ to_camera[:3, :3].T + to_camera[:3, 3]
        for pair in faces.reshape(-1, 6):
            four = np.unique(pair)
            assert len(four) == 4
            _paint(rgba, seen[four], uv[four], colors[four[0]], texture, half, lens["znear"])
    return rgba


def _paint(rgba, corners, uv, color, texture, half, near):
    height, width = rgba.shape[:2]
    if (-corners[:, 2] <= near).any():
        return
    x, y = (corners[:, :2] / -corners[:, 2:] / half).T
    x, y = (x + 1) / 2 * width, (1 - y) / 2 * height
    rows = slice(*np.clip([np.floor(y.min()), np.ceil(y.max())], 0, height).astype(int))
    columns = slice(*np.clip([np.floor(x.min()), np.ceil(x.max())], 0, width).astype(int))
    if rows.start >= rows.stop or columns.start >= columns.stop:
        return
    # Ray d meets the plane at corner 0 + s (corner 1 - 0) + t (corner 3 - 0).
    plane = np.stack([corners[1] - corners[0], corners[3] - corners[0], corners[0]], axis=1)
    if abs(np.linalg.det(plane)) < 1e-12 * np.abs(plane).max() ** 3:  # seen from its edge
        return
    place = (np.arange(SAMPLES) + 0.5) / SAMPLES
    py = (np.arange(rows.start, rows.stop)[:, None] + place).reshape(-1)
    px = (np.arange(columns.start, columns.stop)[:, None] + place).reshape(-1)
    d = np.full((len(py), len(px), 3), -1.0)
    d[..., 0] = (2 * px / width - 1) * half[0]
    d[..., 1] = ((1 - 2 * py / height) * half[1])[:, None]
    a, b, c = np.moveaxis(d @ np.linalg.inv(plane).T, 2, 0)
    with np.errstate(divide="ignore", invalid="ignore"):
        s, t = a / c, b / c
        is_inside = (c > 0) & (s > 0) & (s < 1) & (t > 0) & (t < 1)
    u = uv[0, 0] + (uv[1, 0] - uv[0, 0]) * np.where(is_inside, s, 0)
    v = uv[0, 1] + (uv[3, 1] - uv[0, 1]) * np.where(is_inside, t, 0)
    at = v * texture.shape[0] - 0.5, u * texture.shape[1] - 0.5
    planes = [map_coordinates(plane, at, order=1, mode="nearest") for plane in np.moveaxis(texture, 2, 0)]
    texels = color * np.stack(planes, axis=-1)  # in linear light, as the colors of vertices are
    alpha = np.where(is_inside, texels[..., 3], 0)[..., None]
    layer = alpha * np.append(encoded(texels[..., :3]), np.ones_like(alpha), axis=2)
    layer, alpha = (
        whole.reshape(rows.stop - rows.start, SAMPLES, -1, SAMPLES, whole.shape[2]).mean(axis=(1, 3))
        for whole in (layer, alpha)
    )
    rgba[rows, columns] = layer + (1 - alpha) * rgba[rows, columns]


def encoded(linear):
    """Display-encoded values of linear light, after IEC 61966-2-1."""
    curve = 1.055 * np.maximum(linear, 1e-9) ** (1 / 2.4) - 0.055
    return np.where(linear <= 0.0031308, 12.92 * linear, curve)


def _linear(encoded):
    """Its inverse."""
    return np.where(encoded <= 0.04045, encoded / 12.92, ((encoded + 0.055) / 1.055) ** 2.4)
