"""The nearest neighbors, and what hangs together by links, are those of SciPy."""

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import cKDTree

from brushgs.core.threads import at_most
from brushgs.passes import neighbours
from brushgs.passes.components import components
from tests.kit.for_each import for_each


@for_each(("dimensions", "count"), [(1, 1), (2, 5), (3, 17), (3, 129), (5, 256), (16, 2)])
@for_each("threads", [1, 3])
def test_neighbours_are_those_of_scipy(dimensions, count, threads):
    random = np.random.default_rng([dimensions, count])
    points = random.normal(size=(700, dimensions)).astype(np.float32)
    queries = np.concatenate([points[::3], random.normal(size=(300, dimensions))])
    with at_most(threads):
        distances, rows = neighbours.nearest(points, queries, count)
    expected, expected_rows = cKDTree(points).query(queries, k=range(1, count + 1))
    np.testing.assert_array_equal(distances, expected)
    np.testing.assert_array_equal(rows, expected_rows)


def test_of_equally_near_neighbours_the_first_rows_are_taken():
    grid = np.stack(np.meshgrid(*[np.arange(5.0)] * 3), axis=-1).reshape(-1, 3)
    points = np.concatenate([grid, grid])  # each twice
    distances, rows = neighbours.nearest(points, grid, 20)
    squared = ((grid[:, None] - points) ** 2).sum(axis=2)
    expected = np.argsort(squared, axis=1, kind="stable")[:, :20]
    np.testing.assert_array_equal(rows, expected)
    np.testing.assert_array_equal(distances, np.sqrt(np.take_along_axis(squared, expected, axis=1)))


@for_each("num_links", [0, 1, 150, 400, 5000])
def test_components_are_those_of_scipy(num_links):
    a, b = np.random.default_rng(num_links).integers(0, 500, (2, num_links))
    links = coo_array((np.ones(num_links, bool), (a, b)), shape=(500, 500))
    np.testing.assert_array_equal(components(500, a, b), connected_components(links, directed=False)[1])
