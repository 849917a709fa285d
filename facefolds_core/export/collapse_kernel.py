"""Edge collapse on a triangulation of the (u, v) window that several layers share, compiled.

The error is a quadric (Garland and Heckbert 1997, 1998) in five dimensions: a layer's position relative to c, and its
texture coordinates in units of length. A vertex only moves onto a neighbour (half-edge collapse), so vertices stay
samples.
"""

from __future__ import annotations

import math

import numpy as np

from facefolds_core.kernels.jit import inlined, kernel

MOST_NEIGHBOURS = 64
"""A collapse that would give a vertex more neighbours than this is not made."""

TERMS = 21
"""Of a quadric in five dimensions: 15 of the symmetric matrix, 5 linear, 1 constant."""


@kernel
def _add_face(quadric, p, q, r, weight):  # type: ignore[no-untyped-def]
    """Add weight times the squared distance from the plane through p, q, r (5,) to a quadric (21,)."""
    first = np.empty(5)
    second = np.empty(5)
    length = 0.0
    for i in range(5):
        first[i] = q[i] - p[i]
        length += first[i] * first[i]
    length = math.sqrt(length)
    along = 0.0
    for i in range(5):
        first[i] /= length
        second[i] = r[i] - p[i]
        along += first[i] * second[i]
    height = 0.0
    for i in range(5):
        second[i] -= along * first[i]
        height += second[i] * second[i]
    height = math.sqrt(height)
    if not (length > 0.0 and height > 0.0):
        return
    weight *= 0.5 * length * height
    p1, p2, pp = 0.0, 0.0, 0.0
    for i in range(5):
        second[i] /= height
        p1 += p[i] * first[i]
        p2 += p[i] * second[i]
        pp += p[i] * p[i]
    k = 0
    for i in range(5):
        for j in range(i, 5):
            quadric[k] += weight * ((1.0 if i == j else 0.0) - first[i] * first[j] - second[i] * second[j])
            k += 1
    for i in range(5):
        quadric[15 + i] += weight * (p1 * first[i] + p2 * second[i] - p[i])
    quadric[20] += weight * (pp - p1 * p1 - p2 * p2)


@kernel
def build_quadrics(points, faces, weights):  # type: ignore[no-untyped-def]
    """points (V, L, 5), faces (F, 3), weights (F, L) -> (V, L, 21): sums over each vertex's faces, times their area."""
    quadrics = np.zeros((points.shape[0], points.shape[1], TERMS))
    own = np.empty(TERMS)
    for f in range(faces.shape[0]):
        i, j, k = faces[f, 0], faces[f, 1], faces[f, 2]
        for n in range(points.shape[1]):
            own[:] = 0.0
            _add_face(own, points[i, n], points[j, n], points[k, n], weights[f, n])
            for t in range(TERMS):
                quadrics[i, n, t] += own[t]
                quadrics[j, n, t] += own[t]
                quadrics[k, n, t] += own[t]
    return quadrics


@inlined
def cost(a, b, x):  # type: ignore[no-untyped-def]
    """The sum of two quadrics (21,) at x (5,)."""
    x0, x1, x2, x3, x4 = x[0], x[1], x[2], x[3], x[4]
    value = a[20] + b[20]
    value += 2 * ((a[15] + b[15]) * x0 + (a[16] + b[16]) * x1 + (a[17] + b[17]) * x2)
    value += 2 * ((a[18] + b[18]) * x3 + (a[19] + b[19]) * x4)
    value += (a[0] + b[0]) * x0 * x0 + (a[5] + b[5]) * x1 * x1 + (a[9] + b[9]) * x2 * x2
    value += (a[12] + b[12]) * x3 * x3 + (a[14] + b[14]) * x4 * x4
    value += 2 * x0 * ((a[1] + b[1]) * x1 + (a[2] + b[2]) * x2 + (a[3] + b[3]) * x3 + (a[4] + b[4]) * x4)
    value += 2 * x1 * ((a[6] + b[6]) * x2 + (a[7] + b[7]) * x3 + (a[8] + b[8]) * x4)
    value += 2 * x2 * ((a[10] + b[10]) * x3 + (a[11] + b[11]) * x4) + 2 * x3 * (a[13] + b[13]) * x4
    return value


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
