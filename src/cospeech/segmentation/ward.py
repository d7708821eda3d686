"""Ward's hierarchical clustering with medoids, for any distance (Levine 2009, 2.3).

The error of a cluster is the sum of the distances of its members from its centre, which is the member that makes this
sum least (the medoid), so that nothing but the distances is needed:

    ESS(A) = min over c in A of the sum over s in A of D(c, s)

In every step the two clusters are merged whose union increases the total error least, by

    cost(A, B) = ESS(A + B) - ESS(A) - ESS(B)

Unlike with means of Euclidean data, the cost of a merge may be less than that of an earlier one. A tree is therefore
cut at a number of clusters and not at a cost.

The recursion keeps, for each cluster A and each point c, the sum of the distances of c from the members of A. These
sums are added when clusters are merged, and the error of a union is the least sum of one of its members. For each
cluster, the nearest other one is stored. If that one is merged, the stored cost is still a lower bound of the cost of
merging the cluster with any other one, and its nearest is searched again only when this bound is the least of all
(D. Müllner, Modern hierarchical, agglomerative clustering algorithms, 2011). The result is exact; time and memory are
quadratic in the number of points for clusters of similar sizes.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers, Singles
from cospeech.kernels.jit import njit

SPARSE = 25
"""Looking up a sum, which misses the cache, takes as long as adding this number of distances in order."""


class Tree(NamedTuple):
    """The N - 1 merges of N points, in the order in which they were made.

    A cluster is named after the first of its points in the order of the matrix.

    Attributes
    ----------
    kept, merged : (N - 1,) names of the two clusters; the union has the name ``kept``, which is the smaller one.
    medoid : (N - 1,) the point at the centre of the union.
    cost : (N - 1,) increase of the total error.
    """

    kept: Integers
    merged: Integers
    medoid: Integers
    cost: Floats


class Clusters(NamedTuple):
    """A partition of N points into K clusters, numbered by their first points.

    Attributes
    ----------
    labels : (N,) number of each point's cluster, 0 ... K - 1.
    medoids : (K,) the point at the centre of each cluster.
    """

    labels: Integers
    medoids: Integers


def tree(distances: Singles) -> Tree:
    """Return the merges of all points into one cluster. Equal costs are resolved in the same way in every run.

    Parameters
    ----------
    distances : (N, N) symmetric matrix with zeros on its diagonal, in single precision.
    """
    n_points = len(distances)
    kept, merged, medoid = np.zeros((3, n_points - 1), dtype=np.int64)
    found = Tree(kept, merged, medoid, np.zeros(n_points - 1))
    if n_points > 1:
        # allocated here because numpy, unlike numba, asks for large pages, in which look-ups are faster
        _merge_all(distances, np.empty((n_points // 2, n_points), dtype=np.float32), *found)
    return found


def cut(whole: Tree, n_clusters: int) -> Clusters:
    """Return the partition into ``n_clusters`` clusters, or into single points if there are fewer points.

    Raises
    ------
    ValueError : if ``n_clusters`` is less than 1.
    """
    if n_clusters < 1:
        raise ValueError("a partition has at least one cluster")
    n_points = len(whole.kept) + 1
    centre = np.arange(n_points)
    name = np.arange(n_points)
    n_merges = max(0, n_points - n_clusters)
    for kept, merged, medoid in zip(*(column[:n_merges].tolist() for column in whole[:3]), strict=True):
        name[merged] = kept
        centre[kept] = medoid
    for point in range(n_points):  # the name of a cluster is its first point, whose own name is known by now
        name[point] = name[name[point]]
    names, labels = np.unique(name, return_inverse=True)
    return Clusters(labels.astype(np.int64), centre[names].astype(np.int64))


@njit
def _by_own(a: int, following: Any, own: Any, members: Any) -> Any:
    """Return the members of a cluster, the most central first (shell sort); ``members`` is working memory."""
    n_members = 0
    point = a
    while point >= 0:
        members[n_members] = point
        n_members += 1
        point = following[point]
    gap = n_members // 2
    while gap > 0:
        for k in range(gap, n_members):
            point, place = members[k], k
            while place >= gap and own[members[place - gap]] > own[point]:
                members[place] = members[place - gap]
                place -= gap
            members[place] = point
        gap //= 2
    return members[:n_members]


@njit(fastmath={"nnan", "nsz"})
def _costs(
    distances: Any,
    sums: Any,
    place: Any,
    a: int,
    inside: Any,
    cluster: Any,
    active: Any,
    own: Any,
    error: Any,
    beyond: Any,
    bound: Any,
    cost: Any,
    central: Any,
    chosen: Any,
    limit: Any,
    update: bool,
) -> None:
    """Write the costs of merging cluster a with each of the ``active`` ones.

    A cost that is not the least, and not below ``bound`` of the other cluster, may be too high.

    Parameters
    ----------
    inside : members of a, the most central first.
    cost : (N,), filled by name of the cluster.
    central, chosen, limit : (N,) working memory. ``_merge_all`` describes the other arrays.
    """
    n_points = len(cluster)
    row = distances[a] if place[a] < 0 else sums[place[a]]
    # ``central`` are the sums of the distances of one member of a, the most central first, from the other clusters.
    around = distances[inside[0]]
    for c in active:
        cost[c], central[c] = np.inf, 0.0
    for point in range(n_points):
        c = cluster[point]
        cost[c] = min(cost[c], own[point] + float(row[point]))
        central[c] += float(around[point])
    least = np.inf
    for c in active:
        if c != a:
            best = min(cost[c], own[inside[0]] + central[c])
            cost[c] = best - error[a] - error[c]
            least = min(least, cost[c])
    n_open = 0
    for c in active:
        if c != a and (update or bound[c] < least):
            limit[c] = min(cost[c], max(least, bound[c]) if update else least) + error[a] + error[c]
            chosen[n_open] = c
            n_open += 1
    for member in inside[1:]:
        n_kept = 0
        for k in range(n_open):
            chosen[n_kept] = chosen[k]
            n_kept += own[member] + beyond[chosen[k]] < limit[chosen[k]]
        n_open = n_kept
        if n_open == 0:
            break
        if SPARSE * n_open > n_points:
            central[:] = 0.0
            around = distances[member]
            for point in range(n_points):
                central[cluster[point]] += float(around[point])
        else:
            for k in range(n_open):
                c = chosen[k]
                central[c] = distances[c, member] if place[c] < 0 else sums[place[c], member]
        for k in range(n_open):
            c = chosen[k]
            total = own[member] + central[c]
            if total < limit[c]:
                limit[c], cost[c] = total, total - error[a] - error[c]


@njit
def _merge_all(distances: Any, sums: Any, kept: Any, merged: Any, medoids: Any, costs: Any) -> None:
    """Fill the arrays of a ``Tree``.

    The arrays below describe points, or clusters under the names of these.

    place : row of a cluster in ``sums``; -1 for a single point.
    own : sum of the distances of a point from the members of its cluster.
    beyond : lower bound of the sum of the distances of any other point from the members of a cluster.
    bound : lower bound of the cost of merging a cluster with any other one; attained with ``near`` unless that is -1.
    """
    n_points = len(distances)
    n_sums = n_free = 0
    free = np.empty(n_points, np.int64)
    place, cluster = np.full(n_points, -1), np.arange(n_points)
    following, last = np.full(n_points, -1), np.arange(n_points)
    active = np.arange(n_points)
    own, error = np.zeros(n_points), np.zeros(n_points)
    near, bound = np.full(n_points, -1), np.full(n_points, np.inf)
    cost, central, limit = np.empty(n_points), np.empty(n_points), np.empty(n_points)
    members, chosen = np.empty(n_points, np.int64), np.empty(n_points, np.int64)
    for point in range(n_points):
        for other in range(n_points):
            if other != point and distances[point, other] < bound[point]:
                bound[point], near[point] = distances[point, other], other
    beyond = bound.copy()
    for step in range(n_points - 1):
        while True:
            a = active[0]
            for c in active:
                if bound[c] < bound[a]:
                    a = c
            if near[a] >= 0:
                break
            inside = _by_own(a, following, own, members)
            _costs(
                distances,
                sums,
                place,
                a,
                inside,
                cluster,
                active,
                own,
                error,
                beyond,
                bound,
                cost,
                central,
                chosen,
                limit,
                False,
            )
            bound[a] = np.inf
            for c in active:
                if c != a and cost[c] < bound[a]:
                    bound[a], near[a] = cost[c], c
        a, b = min(a, near[a]), max(a, near[a])
        kept[step], merged[step], costs[step] = a, b, bound[a]
        following[last[a]] = b
        last[a] = last[b]
        active = active[active != b]
        first = distances[a] if place[a] < 0 else sums[place[a]]
        second = distances[b] if place[b] < 0 else sums[place[b]]
        if place[a] < 0 and place[b] < 0:
            if n_free:
                n_free -= 1
                place[a] = free[n_free]
            else:
                place[a] = n_sums
                n_sums += 1
        elif place[a] < 0:
            place[a] = place[b]
        elif place[b] >= 0:
            free[n_free] = place[b]
            n_free += 1
        row = sums[place[a]]
        for point in range(n_points):
            row[point] = first[point] + second[point]
        beyond[a], error[a] = np.inf, np.inf
        for point in range(n_points):
            total = float(row[point])
            if cluster[point] != a and cluster[point] != b:
                beyond[a] = min(beyond[a], total)
                continue
            cluster[point], own[point] = a, total
            if total < error[a]:
                error[a], medoids[step] = total, point
        inside = _by_own(a, following, own, members)
        _costs(
            distances,
            sums,
            place,
            a,
            inside,
            cluster,
            active,
            own,
            error,
            beyond,
            bound,
            cost,
            central,
            chosen,
            limit,
            True,
        )
        bound[a], near[a] = np.inf, -1
        for c in active:
            if c == a:
                continue
            if cost[c] < bound[a]:
                bound[a], near[a] = cost[c], c
            if near[c] == a or near[c] == b:
                near[c] = -1
            if cost[c] < bound[c] or (cost[c] == bound[c] and near[c] < 0):
                bound[c], near[c] = cost[c], a
