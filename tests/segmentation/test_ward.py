import numpy as np
import pytest
from scipy.cluster.hierarchy import fcluster
from scipy.cluster.hierarchy import ward as scipy_ward
from scipy.spatial.distance import cdist, pdist

from cospeech.segmentation import ward


@pytest.fixture
def rng():
    return np.random.default_rng(14)


def error(distances, members):
    """The error of a cluster, and its medoid."""
    sums = distances[np.ix_(members, members)].sum(axis=0)
    return sums.min(), members[sums.argmin()]


def naive(distances):
    """Every merge by comparing all pairs of clusters: rows of kept, merged, cost."""
    clusters = {point: [point] for point in range(len(distances))}
    merges = []
    while len(clusters) > 1:
        errors = {name: error(distances, members)[0] for name, members in clusters.items()}
        cost, a, b = min(
            (error(distances, clusters[a] + clusters[b])[0] - errors[a] - errors[b], a, b)
            for a in clusters
            for b in clusters
            if a < b
        )
        clusters[a] += clusters.pop(b)
        merges.append((a, b, cost))
    return merges


def whole(distances):
    """Symmetric distances as whole numbers of at most 2^18; in single precision, sums of 64 of them are exact."""
    upper = np.triu(np.round(2**18 / distances.max() * distances), 1)
    return (upper + upper.T).astype(np.float32)


def between(points):
    return whole(cdist(points, points))


def cases(rng):
    """Matrices of distances: of points in space, of no space, and of points that are merged one after another."""
    for _ in range(25):
        n_points = int(rng.integers(2, 26))
        points = rng.normal(size=(n_points, 3))
        yield between(points)
        yield whole(rng.random((n_points, n_points)))
        steps = np.cumsum(1.1 ** np.arange(n_points) * rng.uniform(0.9, 1.1, n_points))[:, None]
        yield between(rng.permutation(steps))


def test_merges_are_those_of_comparing_all_pairs(rng):
    inversions = 0
    for distances in cases(rng):
        expected = naive(distances.astype(float))
        found = ward.tree(distances)
        assert list(zip(found.kept, found.merged, strict=True)) == [merge[:2] for merge in expected]
        np.testing.assert_array_equal(found.cost, [merge[2] for merge in expected])
        inversions += bool((np.diff(found.cost) < 0).any())
    assert inversions > 3  # so a tree cannot be cut at a cost


def test_large_clusters_are_exact(rng):
    for n_points in (45, 60):
        points = np.vstack([rng.normal(0, 1, (n_points // 2, 2)), rng.normal(9, 1, (n_points - n_points // 2, 2))])
        distances = between(points)
        expected = naive(distances.astype(float))
        found = ward.tree(distances)
        assert list(zip(found.kept, found.merged, strict=True)) == [merge[:2] for merge in expected]


def test_medoids_and_costs_add_up(rng):
    for distances in cases(rng):
        whole = ward.tree(distances)
        for n_clusters in range(1, len(distances) + 1):
            labels, medoids = ward.cut(whole, n_clusters)
            assert len(medoids) == n_clusters == len(np.unique(labels))
            np.testing.assert_array_equal(labels[medoids], np.arange(n_clusters))
            firsts = [np.flatnonzero(labels == label)[0] for label in range(n_clusters)]
            assert firsts == sorted(firsts)
            total = distances[np.arange(len(labels)), medoids[labels]].sum()
            least = sum(error(distances, np.flatnonzero(labels == label))[0] for label in range(n_clusters))
            assert total == pytest.approx(least)
            assert total == pytest.approx(whole.cost[: len(labels) - n_clusters].sum())


def test_clusters_that_are_apart_are_those_of_scipy(rng):
    for _ in range(20):
        n_clusters = int(rng.integers(2, 7))
        centres = 12.0 * rng.permutation(np.arange(2.0 * n_clusters))[:n_clusters, None] * np.ones(4)
        points = rng.permutation(np.vstack([rng.normal(centre, 1.0, (rng.integers(3, 15), 4)) for centre in centres]))
        ours = ward.cut(ward.tree(between(points)), n_clusters).labels
        theirs = fcluster(scipy_ward(pdist(points)), n_clusters, "maxclust")
        assert len(set(zip(ours, theirs, strict=True))) == n_clusters


def test_the_order_of_the_points_does_not_matter(rng):
    points = rng.normal(size=(80, 3))
    order = rng.permutation(len(points))
    for n_clusters in (2, 9, 30):
        labels = ward.cut(ward.tree(between(points)), n_clusters).labels
        shuffled = ward.cut(ward.tree(between(points[order])), n_clusters).labels
        assert len(set(zip(labels[order], shuffled, strict=True))) == n_clusters


def test_few_points():
    def equal(n_points):
        return np.zeros((n_points, n_points), dtype=np.float32)

    one = ward.cut(ward.tree(equal(1)), 3)
    assert one.labels.tolist() == one.medoids.tolist() == [0]
    same = ward.cut(ward.tree(equal(5)), 2)
    assert len(same.medoids) == 2
    assert set(same.labels) == {0, 1}
    with pytest.raises(ValueError, match="at least one cluster"):
        ward.cut(ward.tree(equal(2)), 0)
