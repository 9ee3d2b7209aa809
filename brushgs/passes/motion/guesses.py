"""First guesses of how a scene, or parts of it, moved between two moments.

Gaussians that look alike in both moments are paired, wherever they are. Most pairs may be wrong: motions are
fitted to three random pairs each, and the one with the most support is kept (RANSAC), repeatedly for bodies
that move independently. Where looks are uninformative, a set of rotations is tried.
Source: Fischler and Bolles 1981, Random sample consensus.
"""

import numpy as np

from brushgs.passes.motion.appearance import Appearance, among
from brushgs.passes.neighbours import nearest
from brushgs.values.arrays import F64, Mask
from brushgs.values.quats import rotation_matrices, turn_forms

NUM_PAIRS = 2000  # pairs that are formed
CLEAREST = 0.6  # share of pairs kept, by the ratio of distances to the best and second-best match
NUM_DRAWN = 400
MOST_BODIES = 4
# In radii of the scene: scale of the score of a motion, and maximum error of a pair that agrees with it.
EXACT, SAME = 0.02, 0.1
LEAST_AGREEING = 0.03  # share of all pairs
LEAST_GAIN = 3.0  # factor of the number of pairs that agree after partners are shuffled
MOST_GROWTH = 2.5  # factor of size of a body between moments
TURN_STEP = 15.0  # degrees, of the tried rotations
NUM_TRIED, NUM_TARGETS = 600, 3600  # Gaussians rotated, and those among which neighbors are searched
LOOKS_WEIGHT = 0.125  # of looks, relative to a radius of the scene
NUM_REFINED, NUM_ROUNDS = 3, 12  # best rotations refined, and rounds of iterative closest points (ICP)
TRIMMED = 0.8  # share of the Gaussians that count: the nearest


Motion = tuple[F64, F64]  # a matrix [3, 3] and a shift [3]: y = A x + t, world units


def guesses(before: Appearance, after: Appearance, rng: np.random.Generator) -> list[Motion]:
    """Motions of bodies by pairs that look alike, in the order found; may be empty."""
    if min(len(before), len(after)) < 3:
        return []
    some = rng.permutation(len(before))[:NUM_PAIRS]
    distances, rows = nearest(after.looks, before.looks[some], 2)
    clear = np.argsort(distances[:, 0] / np.maximum(distances[:, 1], 1e-12), kind="stable")
    clear = clear[: max(3, round(CLEAREST * len(some)))]
    x = _normalized(before, before.means[some[clear]])
    y = _normalized(after, after.means[rows[clear, 0]])
    found: list[Motion] = []
    is_left = np.ones(len(x), bool)
    while len(found) < MOST_BODIES and np.count_nonzero(is_left) >= 3:
        motion, agreeing = _agreed(x[is_left], y[is_left], rng)
        if motion is None or np.count_nonzero(agreeing) < max(3, LEAST_AGREEING * len(x)):
            break
        by_chance = _agrees(motion, x[is_left], rng.permutation(y[is_left]))
        if np.count_nonzero(agreeing) < LEAST_GAIN * np.count_nonzero(by_chance):
            break
        found.append(_in_world(motion, before, after))
        is_left[np.flatnonzero(is_left)[agreeing]] = False
    return found


def _agreed(x: F64, y: F64, rng: np.random.Generator) -> tuple[Motion | None, Mask]:
    """The motion with the most support among pairs [p, 3], and which of them agree with it [p]."""
    drawn = rng.integers(len(x), size=(NUM_DRAWN, 3))
    matrices, shifts = similarities(x[drawn], y[drawn])
    growths = np.cbrt(np.abs(np.linalg.det(matrices)))
    sound = (growths > 1 / MOST_GROWTH) & (growths < MOST_GROWTH)
    if not sound.any():
        return None, np.zeros(len(x), bool)
    matrices, shifts = matrices[sound], shifts[sound]
    judges = slice(NUM_DRAWN)  # pairs are sorted, clearest first
    moved = np.einsum("hij,nj->hni", matrices, x[judges]) + shifts[:, None]
    squares = ((moved - y[judges]) ** 2).sum(axis=2)
    best = int((1 / (1 + squares / EXACT**2)).sum(axis=1).argmax())
    motion = matrices[best], shifts[best]
    for reach in (SAME, SAME / 2, SAME / 2):
        away = np.linalg.norm(_moved(motion, x) - y, axis=1)
        motion = affine(x, y, np.exp(-((away / reach) ** 2)) + 1e-9)
    return motion, _agrees(motion, x, y)


def _agrees(motion: Motion, x: F64, y: F64) -> Mask:
    return np.asarray(np.linalg.norm(_moved(motion, x) - y, axis=1) < SAME)


def turns_tried(before: Appearance, after: Appearance, rng: np.random.Generator) -> list[Motion]:
    """The best rotations of the whole scene about three axes, refined by ICP, best first."""
    some = rng.permutation(len(before))[:NUM_TRIED]
    others = rng.permutation(len(after))[:NUM_TARGETS]
    x = _normalized(before, before.means[some])
    y = _normalized(after, after.means[others])
    looks = LOOKS_WEIGHT * before.looks[some]
    targets = np.concatenate([y, LOOKS_WEIGHT * after.looks[others]], axis=1)

    def away(motion: Motion) -> tuple[float, F64, F64]:
        """Trimmed mean distance to the nearest Gaussians, their positions, and weights of the pairs."""
        moved = _moved(motion, x)
        distances, rows = among(np.concatenate([moved, looks], axis=1, dtype=np.float32), targets)
        last = np.quantile(distances, TRIMMED)
        near = distances <= last
        return float(distances[near].mean()), y[rows], np.where(near, 1.0, 1e-9)

    angles = np.radians(np.arange(TURN_STEP, 360, TURN_STEP)) / 2
    quats = np.zeros((3, len(angles), 4))
    quats[..., 0] = np.cos(angles)
    for axis in range(3):
        quats[axis, :, 1 + axis] = np.sin(angles)
    tried: list[Motion] = [(turn, np.zeros(3)) for turn in rotation_matrices(quats.reshape(-1, 4))]
    tried.sort(key=lambda motion: away(motion)[0])
    found = []
    for motion in tried[:NUM_REFINED]:
        for _ in range(NUM_ROUNDS):
            _, nearest_y, weights = away(motion)
            motion = affine(x, nearest_y, weights)
        found.append((away(motion)[0], motion))
    return [_in_world(motion, before, after) for _, motion in sorted(found, key=lambda pair: pair[0])]


def similarities(x: F64, y: F64, weights: F64 | None = None) -> Motion:
    """Least-squares similarities, matrices [..., 3, 3] and shifts [..., 3], between points [..., p, 3].

    Source: Horn 1987, Closed-form solution of absolute orientation using unit quaternions.
    """
    weights = np.full(x.shape[:-1], 1.0) if weights is None else weights
    shares = weights / weights.sum(axis=-1, keepdims=True)
    mean_x, mean_y = ((shares[..., None] * points).sum(axis=-2) for points in (x, y))
    from_x, from_y = x - mean_x[..., None, :], y - mean_y[..., None, :]
    crossed = np.einsum("...p,...pi,...pj->...ij", shares, from_y, from_x)
    forms = turn_forms(crossed.reshape(-1, 3, 3))
    rotations = rotation_matrices(np.linalg.eigh(forms)[1][:, :, -1]).reshape(crossed.shape)
    spreads = (shares[..., None] * from_x**2).sum(axis=(-2, -1))
    together = np.einsum("...ij,...ij->...", rotations, crossed)
    growths = np.where(spreads > 0, np.maximum(together, 0) / np.maximum(spreads, 1e-300), 1.0)
    matrices = rotations * growths[..., None, None]
    return matrices, mean_y - np.einsum("...ij,...j->...i", matrices, mean_x)


def affine(x: F64, y: F64, weights: F64) -> Motion:
    """The least-squares affine map between points [p, 3], regularised towards a similarity."""
    shares = weights / weights.sum()
    mean_x, mean_y = shares @ x, shares @ y
    from_x, from_y = x - mean_x, y - mean_y
    spread = (from_x * shares[:, None]).T @ from_x
    crossed = (from_y * shares[:, None]).T @ from_x
    prior = max(1e-3 * float(np.trace(spread)) / 3, 1e-300)
    matrix = np.linalg.solve(
        spread + prior * np.eye(3), (crossed + prior * similarities(x, y, weights)[0]).T
    ).T
    return matrix, mean_y - matrix @ mean_x


def _moved(motion: Motion, x: F64) -> F64:
    return np.asarray(x @ motion[0].T + motion[1])


def _normalized(moment: Appearance, means: F64) -> F64:
    center, radius = moment.frame
    return np.asarray((means - center) / radius)


def _in_world(motion: Motion, before: Appearance, after: Appearance) -> Motion:
    """A motion of normalized positions, converted to world units."""
    (center, radius), (new_center, new_radius) = before.frame, after.frame
    matrix = motion[0] * (new_radius / radius)
    return matrix, new_center + new_radius * motion[1] - matrix @ center
