"""Edge collapse on a triangulation of the (u, v) window that several layers share, compiled.

The error is that of `quadrics_kernel.py`. A vertex only moves onto a neighbour (half-edge collapse), so vertices stay
samples.
"""

from __future__ import annotations

import numpy as np

from facefolds_core.export.quadrics_kernel import TERMS, cost
from facefolds_core.kernels.jit import inlined, kernel

MOST_NEIGHBOURS = 64
"""A collapse that would give a vertex more neighbours than this is not made."""


@inlined
def _upright(st, directions, i, j, k, least):  # type: ignore[no-untyped-def]
    """Triangle (i, j, k) keeps its side in the plane of (s, t) and of `Chart.unrolled`."""
    area = (st[j, 0] - st[i, 0]) * (st[k, 1] - st[i, 1]) - (st[j, 1] - st[i, 1]) * (st[k, 0] - st[i, 0])
    if -area <= least:  # t points down
        return False
    a, b, c = directions[i], directions[j], directions[k]
    det = a[0] * (b[1] * c[2] - b[2] * c[1]) + a[1] * (b[2] * c[0] - b[0] * c[2]) + a[2] * (b[0] * c[1] - b[1] * c[0])
    return det > 0.0


@kernel
def _neighbours(v, faces, alive, head, after, found):  # type: ignore[no-untyped-def]
    """Writes v's neighbours to `found`, unlinks its dead faces; returns how many (MOST_NEIGHBOURS if more)."""
    count = 0
    previous = -1
    corner = head[v]
    while corner >= 0:
        f = corner // 3
        if not alive[f]:
            if previous < 0:
                head[v] = after[corner]
            else:
                after[previous] = after[corner]
            corner = after[corner]
            continue
        for k in range(3):
            w = faces[f, k]
            if w == v:
                continue
            known = False
            for n in range(count):
                known = known or found[n] == w
            if not known and count < MOST_NEIGHBOURS:
                found[count] = w
                count += 1
        previous = corner
        corner = after[corner]
    return count


@kernel
def _may_collapse(v, w, faces, alive, head, after, st, directions, least):  # type: ignore[no-untyped-def]
    """Whether all of v's faces that do not hold w stay upright with w in the place of v."""
    corner = head[v]
    while corner >= 0:
        f = corner // 3
        if alive[f]:
            i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
            if i != w and j != w and k != w:
                i, j, k = (w if i == v else i), (w if j == v else j), (w if k == v else k)
                if not _upright(st, directions, i, j, k, least):
                    return False
        corner = after[corner]
    return True


@kernel
def _best(v, faces, alive, head, after, st, directions, borders, points, quadrics, least, around):  # type: ignore[no-untyped-def]
    """The cheapest neighbour that v may move onto, and its cost; -1 and infinity if there is none."""
    best, best_cost = -1, np.inf
    count = _neighbours(v, faces, alive, head, after, around)
    for n in range(count):
        w = around[n]
        if borders[v] & borders[w] != borders[v]:
            continue
        total = 0.0
        for layer in range(points.shape[1]):
            total += cost(quadrics[v, layer], quadrics[w, layer], points[w, layer])
        if total < best_cost and _may_collapse(v, w, faces, alive, head, after, st, directions, least):
            best, best_cost = w, total
    return best, best_cost


@kernel
def _sift(heap, place, keys, position, size):  # type: ignore[no-untyped-def]
    """Restore the order of the binary heap after the key at `position` changed."""
    v = heap[position]
    while position > 0 and keys[heap[(position - 1) // 2]] > keys[v]:
        parent = (position - 1) // 2
        heap[position] = heap[parent]
        place[heap[position]] = position
        position = parent
    while True:
        child = 2 * position + 1
        if child >= size:
            break
        if child + 1 < size and keys[heap[child + 1]] < keys[heap[child]]:
            child += 1
        if keys[heap[child]] >= keys[v]:
            break
        heap[position] = heap[child]
        place[heap[position]] = position
        position = child
    heap[position] = v
    place[v] = position


@kernel
def collapse(  # type: ignore[no-untyped-def]
    st,  # (V, 2) float64
    directions,  # (V, 3) float64, unit
    borders,  # (V,) uint8: bits of the window's borders that a vertex lies on
    points,  # (V, L, 5) float64
    faces,  # (F, 3) int64, changed in place
    quadrics,  # (V, L, 21) float64, changed in place
    targets,  # (T,) numbers of vertices wanted, descending
    least,  # twice the area in (s, t) that a triangle keeps
):
    """(T, F, 3) int64: the faces when at most so many vertices are left, or no vertex may move any more; -1: gone."""
    found = np.empty((targets.shape[0], faces.shape[0], 3), np.int64)
    step = 0
    count = st.shape[0]
    alive = np.ones(faces.shape[0], np.bool_)
    head = np.full(count, -1, np.int64)
    after = np.full(3 * faces.shape[0], -1, np.int64)
    for f in range(faces.shape[0]):
        for k in range(3):
            after[3 * f + k] = head[faces[f, k]]
            head[faces[f, k]] = 3 * f + k
    around = np.empty(MOST_NEIGHBOURS, np.int64)
    others = np.empty(MOST_NEIGHBOURS, np.int64)
    keys = np.full(count, np.inf)
    onto = np.full(count, -1, np.int64)
    for v in range(count):
        if head[v] >= 0:
            onto[v], keys[v] = _best(
                v, faces, alive, head, after, st, directions, borders, points, quadrics, least, others
            )
    heap = np.argsort(keys, kind="mergesort")
    place = np.empty(count, np.int64)
    for n in range(count):
        place[heap[n]] = n
    size, left = count, 0
    for v in range(count):
        left += head[v] >= 0
    while step < targets.shape[0]:
        if left <= targets[step] or keys[heap[0]] == np.inf:
            for f in range(faces.shape[0]):
                for k in range(3):
                    found[step, f, k] = faces[f, k] if alive[f] else -1
            step += 1
            continue
        v = heap[0]
        w = onto[v]
        size -= 1
        heap[0] = heap[size]
        place[heap[0]] = 0
        _sift(heap, place, keys, 0, size)
        corner = head[v]
        while corner >= 0:
            f, following = corner // 3, after[corner]
            if alive[f]:
                if faces[f, 0] == w or faces[f, 1] == w or faces[f, 2] == w:
                    alive[f] = False
                else:
                    faces[f, corner % 3] = w
                    after[corner] = head[w]
                    head[w] = corner
            corner = following
        head[v] = -1
        left -= 1
        for layer in range(points.shape[1]):
            for t in range(TERMS):
                quadrics[w, layer, t] += quadrics[v, layer, t]
        near = _neighbours(w, faces, alive, head, after, around)
        around[min(near, MOST_NEIGHBOURS - 1)] = w
        for n in range(min(near, MOST_NEIGHBOURS - 1) + 1):
            x = around[n]
            onto[x], keys[x] = _best(
                x, faces, alive, head, after, st, directions, borders, points, quadrics, least, others
            )
            _sift(heap, place, keys, place[x], size)
    return found
