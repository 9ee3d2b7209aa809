"""A pinhole camera, and the default view of a scene."""

from dataclasses import dataclass, replace
from math import radians

import numpy as np
from numpy.typing import ArrayLike

from brushgs.values.arrays import F64, check


@dataclass(frozen=True, eq=False)
class FirstView:
    """The default view of a scene.

    Cameras depend only on this and on the user's options. Strokes stored with the first view of their scene
    therefore get the same cameras as the scene.

    Attributes:
        points: [m, 3] vertices of the convex hull of the subject, float64, world units; framing needs no
            other points.
        up: [3] unit vector, world axes.
        azimuth: radians, see `frame_scene`.
        elevation: radians above the horizon.
        eye: [3] position of a camera inside the scene, which looks along azimuth and elevation; None if the
            subject is framed from outside.
        has_surroundings: whether the scene is more than its subject.
        probability: that `up` is right, 0 to 1; None if `up` was given, not estimated.
        ups: the six axes with their probabilities, most probable first; empty if `up` was given.
        front: azimuth of the front of the subject, radians; `azimuth` may lie to one side of it.
        is_front_sure: False if the front was estimated and the back scores almost as high.
        whole: [2, 3] low and high corner of the whole scene without strays; None if the scene is only its
            subject.
        stood: [k, 2] azimuth and elevation of the cameras that captured the scene, radians; None if unknown.
        photograph: from which the scene was predicted; None for other scenes.
    """

    points: F64
    up: F64
    azimuth: float
    elevation: float
    eye: F64 | None = None
    has_surroundings: bool = False
    probability: float | None = None
    ups: tuple[tuple[str, float], ...] = ()
    front: float = 0.0
    is_front_sure: bool = True
    whole: F64 | None = None
    stood: F64 | None = None
    photograph: "Photograph | None" = None


@dataclass(frozen=True, eq=False)
class Photograph:
    """The photograph that a scene was predicted from.

    Attributes:
        camera: that took it.
        pivot: [3] point at the median depth ahead of it, about which the camera may sway, world axes.
        cone: radians to each side up to which the scene has hardly any holes.
    """

    camera: "Camera"
    pivot: F64
    cone: float


@dataclass(frozen=True, eq=False)
class Camera:
    """One pinhole camera.

    Attributes:
        viewmat: [4, 4] camera from world, rigid (rotation and translation, no scale), float64.
        K: [3, 3] pinhole intrinsics in pixels, without skew, float64.
        width: image width in pixels, >= 1.
        height: image height in pixels, >= 1.
        near: near plane: Gaussians at or below this camera z are culled; world units, > 0.

    Raises:
        ValueError: if a shape or value breaks the rules above.
    """

    viewmat: F64  # [4, 4]
    K: F64  # [3, 3]
    width: int
    height: int
    near: float = 0.01

    def __post_init__(self) -> None:
        viewmat = np.array(self.viewmat, dtype=np.float64)
        K = np.array(self.K, dtype=np.float64)
        check("Camera", viewmat=(viewmat, "4 4"), K=(K, "3 3"))
        for name, matrix in (("viewmat", viewmat), ("K", K)):
            if not np.isfinite(matrix).all():
                raise ValueError(f"Camera: {name} must be finite, got {matrix.tolist()}")
            matrix.flags.writeable = False
            object.__setattr__(self, name, matrix)
        rotation = viewmat[:3, :3]
        is_rotation = np.allclose(rotation @ rotation.T, np.eye(3), atol=1e-4) and np.linalg.det(rotation) > 0
        if not is_rotation or not np.array_equal(viewmat[3], (0, 0, 0, 1)):
            raise ValueError(
                "Camera: viewmat must be a rotation and a translation; remove scale and mirroring"
            )
        if (
            K[0, 0] <= 0
            or K[1, 1] <= 0
            or K[0, 1] != 0
            or K[1, 0] != 0
            or not np.array_equal(K[2], (0, 0, 1))
        ):
            raise ValueError(f"Camera: K must be [[fx, 0, cx], [0, fy, cy], [0, 0, 1]], got {K.tolist()}")
        if self.width < 1 or self.height < 1:
            raise ValueError(f"Camera: size must be at least 1x1, got {self.width}x{self.height}")
        if not self.near > 0:
            raise ValueError(f"Camera: near must be > 0, got {self.near}")

    @classmethod
    def look_at(
        cls,
        eye: ArrayLike,
        target: ArrayLike,
        up: ArrayLike = (0.0, -1.0, 0.0),
        *,
        width: int,
        height: int,
        fov_y: float = radians(50.0),
        near: float = 0.01,
    ) -> "Camera":
        """A camera at `eye` that looks at `target`, with `up` pointing up in the picture.

        Args:
            eye: [3] camera center, world units.
            target: [3] point in the middle of the picture, world units.
            up: [3] direction in the world, any length. If it is parallel to the view direction, another axis
                replaces it.
            width: pixels.
            height: pixels.
            fov_y: vertical field of view, radians, in (0, pi).
            near: world units, > 0.

        Raises:
            ValueError: if `eye` and `target` coincide or `fov_y` is out of range.

        Example:
            >>> bg.Camera.look_at((0, -1, -4), (0, 0, 0), width=640, height=480)
            Camera(640x480, 50 degrees high, at 0, -1, -4)
        """
        eye, target, up = (np.asarray(v, dtype=np.float64) for v in (eye, target, up))
        forward = target - eye
        distance = np.linalg.norm(forward)
        if not distance > 0 or not np.isfinite(distance):
            raise ValueError(f"Camera: eye and target must differ, got {eye.tolist()} and {target.tolist()}")
        if not 0 < fov_y < np.pi:
            raise ValueError(f"Camera: fov_y must be in (0, pi) radians, got {fov_y}")
        forward = forward / distance
        right = np.cross(forward, up)
        if np.linalg.norm(right) < 1e-9 * np.linalg.norm(up) + 1e-300:
            right = np.cross(forward, np.eye(3)[np.argmin(np.abs(forward))])
        right = right / np.linalg.norm(right)
        viewmat = np.eye(4)
        viewmat[:3, :3] = right, np.cross(forward, right), forward
        viewmat[:3, 3] = -viewmat[:3, :3] @ eye
        focal = 0.5 * height / np.tan(0.5 * fov_y)
        K = np.array([[focal, 0.0, 0.5 * width], [0.0, focal, 0.5 * height], [0.0, 0.0, 1.0]])
        return cls(viewmat, K, width, height, near)

    def __repr__(self) -> str:
        fov = np.degrees(2 * np.arctan(0.5 * self.height / self.K[1, 1]))
        x, y, z = self.position
        return f"Camera({self.width}x{self.height}, {fov:.4g} degrees high, at {x:.4g}, {y:.4g}, {z:.4g})"

    @property
    def position(self) -> F64:
        """[3] camera center in world units."""
        return np.asarray(-self.viewmat[:3, :3].T @ self.viewmat[:3, 3])

    def resized(self, width: int, height: int) -> "Camera":
        """The same view in another size: same vertical field of view, sides cropped or extended."""
        factor = height / self.height
        K = self.K.copy()
        K[:2, :2] *= factor
        K[0, 2] = 0.5 * width + (K[0, 2] - 0.5 * self.width) * factor
        K[1, 2] *= factor
        return replace(self, K=K, width=width, height=height)

    def in_side(self, side: int) -> "Camera":
        """The same view, `resized` to `side` pixels along its longer side, >= 1."""
        share = side / max(self.width, self.height)
        return self.resized(max(round(share * self.width), 1), max(round(share * self.height), 1))
