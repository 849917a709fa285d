"""Shading of stored crossings, forwards and backwards in one pass, compiled for CPUs."""

from __future__ import annotations

from typing import Any

import numba
import numpy as np
from numpy.typing import NDArray

Array = NDArray[Any]
_FASTMATH = {"contract", "afn", "arcp", "nsz", "reassoc"}
THREADS = 2


@numba.njit(fastmath=_FASTMATH, error_model="numpy", parallel=True, cache=True)
def shade(
    codes,  # (P, N, 2) uint16 column, row of the crossing in the window; 0 where missed
    rays,  # (R,) indices into codes
    target,  # (R, 3) uint8
    background,  # (R, 3) float32
    texture,  # (H, W, N, 4) activated rgb, alpha
    grad,  # (THREADS, H, W, N, 4) accumulated into
    through,  # (R,) out: transmittance
    residual,  # (R, 3) out
    opaque: float,  # stop below this transmittance
    faint: float,  # layers with less alpha are skipped
    veil,
    binary,
):  # type: ignore[no-untyped-def]
    H, W, N = texture.shape[0], texture.shape[1], texture.shape[2]
    count = rays.shape[0]
    sx, sy = W / 65534.0, H / 65534.0
    threads = grad.shape[0]
    for thread in numba.prange(threads):
        g = grad[thread]
        lo, hi = count * thread // threads, count * (thread + 1) // threads
        layer = np.empty(N, np.int64)
        ti = np.empty(N, np.int64)
        tj = np.empty(N, np.int64)
        w = np.empty((N, 4), np.float32)
        c = np.empty((N, 4), np.float32)
        before = np.empty(N, np.float32)
        for k in range(lo, hi):
            p = rays[k]
            T = np.float32(1.0)
            r0 = np.float32(0.0)
            r1 = np.float32(0.0)
            r2 = np.float32(0.0)
            m = 0
            for n in range(N):
                qx = codes[p, n, 0]
                if qx == 0:
                    continue
                x = min(max((qx - 1) * sx - 0.5, 0.0), W - 1.0)
                y = min(max((codes[p, n, 1] - 1) * sy - 0.5, 0.0), H - 1.0)
                j = min(int(x), W - 2)
                i = min(int(y), H - 2)
                b = np.float32(x - j)
                a = np.float32(y - i)
                one = np.float32(1.0)
                w00 = (one - a) * (one - b)
                w01 = (one - a) * b
                w10 = a * (one - b)
                w11 = a * b
                alpha = w00 * texture[i, j, n, 3] + w01 * texture[i, j + 1, n, 3] + w10 * texture[i + 1, j, n, 3] + w11 * texture[i + 1, j + 1, n, 3]
                if alpha < faint:
                    continue
                for q in range(3):
                    c[m, q] = w00 * texture[i, j, n, q] + w01 * texture[i, j + 1, n, q] + w10 * texture[i + 1, j, n, q] + w11 * texture[i + 1, j + 1, n, q]
                c[m, 3] = alpha
                w[m, 0] = w00
                w[m, 1] = w01
                w[m, 2] = w10
                w[m, 3] = w11
                layer[m] = n
                ti[m] = i
                tj[m] = j
                before[m] = T
                wt = T * alpha
                r0 += wt * c[m, 0]
                r1 += wt * c[m, 1]
                r2 += wt * c[m, 2]
                T *= one - alpha
                m += 1
                if T < opaque:
                    break
            s0, s1, s2 = background[k, 0], background[k, 1], background[k, 2]
            inv = np.float32(1 / 255.0)
            d0 = r0 + T * s0 - target[k, 0] * inv
            d1 = r1 + T * s1 - target[k, 1] * inv
            d2 = r2 + T * s2 - target[k, 2] * inv
            through[k] = T
            residual[k, 0] = d0
            residual[k, 1] = d1
            residual[k, 2] = d2
            dT = binary * (1 - 2 * T) - veil
            rest = np.float32(1.0)
            for q in range(m - 1, -1, -1):
                alpha = c[q, 3]
                T = before[q]
                da = T * (d0 * (c[q, 0] - s0) + d1 * (c[q, 1] - s1) + d2 * (c[q, 2] - s2) - dT * rest)
                rest *= 1 - alpha
                wt = T * alpha
                s0 = alpha * c[q, 0] + (1 - alpha) * s0
                s1 = alpha * c[q, 1] + (1 - alpha) * s1
                s2 = alpha * c[q, 2] + (1 - alpha) * s2
                e0, e1, e2 = wt * d0, wt * d1, wt * d2
                i, j, n = ti[q], tj[q], layer[q]
                for tap in range(4):
                    ww = w[q, tap]
                    ii = i + (tap >> 1)
                    jj = j + (tap & 1)
                    g[ii, jj, n, 0] += ww * e0
                    g[ii, jj, n, 1] += ww * e1
                    g[ii, jj, n, 2] += ww * e2
                    g[ii, jj, n, 3] += ww * da


@numba.njit(fastmath=_FASTMATH, error_model="numpy", parallel=True, cache=True)
def composite(codes, rays, texture, through, rgb):  # type: ignore[no-untyped-def]
    """forward only"""
    H, W, N = texture.shape[0], texture.shape[1], texture.shape[2]
    sx, sy = W / 65534.0, H / 65534.0
    for k in numba.prange(rays.shape[0]):
        p = rays[k]
        T = 1.0
        r0 = 0.0
        r1 = 0.0
        r2 = 0.0
        for n in range(N):
            qx = codes[p, n, 0]
            if qx == 0:
                continue
            x = min(max((qx - 1) * sx - 0.5, 0.0), W - 1.0)
            y = min(max((codes[p, n, 1] - 1) * sy - 0.5, 0.0), H - 1.0)
            j = min(int(x), W - 2)
            i = min(int(y), H - 2)
            b = x - j
            a = y - i
            w00 = (1 - a) * (1 - b)
            w01 = (1 - a) * b
            w10 = a * (1 - b)
            w11 = a * b
            alpha = w00 * texture[i, j, n, 3] + w01 * texture[i, j + 1, n, 3] + w10 * texture[i + 1, j, n, 3] + w11 * texture[i + 1, j + 1, n, 3]
            wt = T * alpha
            r0 += wt * (w00 * texture[i, j, n, 0] + w01 * texture[i, j + 1, n, 0] + w10 * texture[i + 1, j, n, 0] + w11 * texture[i + 1, j + 1, n, 0])
            r1 += wt * (w00 * texture[i, j, n, 1] + w01 * texture[i, j + 1, n, 1] + w10 * texture[i + 1, j, n, 1] + w11 * texture[i + 1, j + 1, n, 1])
            r2 += wt * (w00 * texture[i, j, n, 2] + w01 * texture[i, j + 1, n, 2] + w10 * texture[i + 1, j, n, 2] + w11 * texture[i + 1, j + 1, n, 2])
            T *= 1 - alpha
        through[k] = T
        rgb[k, 0] = r0
        rgb[k, 1] = r1
        rgb[k, 2] = r2


@numba.njit(fastmath=_FASTMATH, error_model="numpy", parallel=True, cache=True)
def activate(static, delta, out):  # type: ignore[no-untyped-def]
    """out = colour clamp / alpha sigmoid of static + delta.  All (H, W, N, 4)."""
    a = static.reshape(-1, 4)
    b = delta.reshape(-1, 4)
    o = out.reshape(-1, 4)
    for k in numba.prange(a.shape[0]):
        for q in range(3):
            o[k, q] = min(max(a[k, q] + b[k, q], np.float32(0.0)), np.float32(1.0))
        o[k, 3] = 1 / (1 + np.exp(-(a[k, 3] + b[k, 3])))


@numba.njit(fastmath=_FASTMATH, error_model="numpy", parallel=True, cache=True)
def adam(static, ms, vs, delta, md, vd, out, grad, lr_s, lr_d, lr_alpha, decay_d, b1, b2, cs1, cs2, cd1, cd2, spars):  # type: ignore[no-untyped-def]
    """One lazy Adam step on static and delta from the gradient of the activated texture; clears grad."""
    a = static.reshape(-1, 4)
    b = delta.reshape(-1, 4)
    o = out.reshape(-1, 4)
    ams = ms.reshape(-1, 4)
    avs = vs.reshape(-1, 4)
    amd = md.reshape(-1, 4)
    avd = vd.reshape(-1, 4)
    g0 = grad[0].reshape(-1, 4)
    g1 = grad[1].reshape(-1, 4)
    eps = np.float32(1e-8)
    for k in numba.prange(a.shape[0]):
        if g0[k, 3] == 0 and g1[k, 3] == 0 and g0[k, 0] == 0 and g1[k, 0] == 0:
            continue
        for q in range(4):
            g = g0[k, q] + g1[k, q]
            g0[k, q] = 0
            g1[k, q] = 0
            ls, ld = lr_s, lr_d
            if q == 3:
                al = o[k, 3]
                g = (g + spars) * al * (1 - al)
                ls = lr_s * lr_alpha
                ld = lr_d * lr_alpha
            ams[k, q] = b1 * ams[k, q] + (1 - b1) * g
            avs[k, q] = b2 * avs[k, q] + (1 - b2) * g * g
            a[k, q] -= ls * (ams[k, q] * cs1) / (np.sqrt(avs[k, q] * cs2) + eps)
            if q < 3:
                a[k, q] = min(max(a[k, q], np.float32(-0.1)), np.float32(1.1))
            amd[k, q] = b1 * amd[k, q] + (1 - b1) * g
            avd[k, q] = b2 * avd[k, q] + (1 - b2) * g * g
            b[k, q] -= ld * (amd[k, q] * cd1) / (np.sqrt(avd[k, q] * cd2) + eps) 
            b[k, q] *= decay_d


@numba.njit(fastmath=_FASTMATH, error_model="numpy", parallel=True, cache=True)
def activate2(base, layers, fbase, falpha, out):  # type: ignore[no-untyped-def]
    """base (M,3), layers (M,N,4), fbase (M,3), falpha (M,N) -> out (M,N,4)."""
    M, N = layers.shape[0], layers.shape[1]
    for k in numba.prange(M):
        for n in range(N):
            for q in range(3):
                out[k, n, q] = min(max(base[k, q] + fbase[k, q] + layers[k, n, q], np.float32(0.0)), np.float32(1.0))
            out[k, n, 3] = 1 / (1 + np.exp(-(layers[k, n, 3] + falpha[k, n])))


@numba.njit(fastmath=_FASTMATH, error_model="numpy", inline="always")
def _step(p, m, v, g, lr, b1, b2, c1, c2):  # type: ignore[no-untyped-def]
    m = b1 * m + (1 - b1) * g
    v = b2 * v + (1 - b2) * g * g
    return p - lr * (m * c1) / (np.sqrt(v * c2) + np.float32(1e-8)), m, v


@numba.njit(fastmath=_FASTMATH, error_model="numpy", parallel=True, cache=True)
def adam2(base, mb, vb, layers, ml, vl, fbase, mfb, vfb, falpha, mfa, vfa, out, grad, lr, lr_l, lr_f, lr_a, lr_fa, dec_l, dec_f, b1, b2, cs1, cs2, cd1, cd2, spars):  # type: ignore[no-untyped-def]
    M, N = layers.shape[0], layers.shape[1]
    g0 = grad[0].reshape(M, N, 4)
    g1 = grad[1].reshape(M, N, 4)
    for k in numba.prange(M):
        s = np.zeros(3, np.float32)
        any_ = False
        for n in range(N):
            if g0[k, n, 3] == 0 and g1[k, n, 3] == 0 and g0[k, n, 0] == 0 and g1[k, n, 0] == 0:
                continue
            any_ = True
            for q in range(3):
                g = g0[k, n, q] + g1[k, n, q]
                s[q] += g
                layers[k, n, q], ml[k, n, q], vl[k, n, q] = _step(layers[k, n, q], ml[k, n, q], vl[k, n, q], g, lr_l, b1, b2, cs1, cs2)
                layers[k, n, q] *= dec_l
            al = out[k, n, 3]
            g = (g0[k, n, 3] + g1[k, n, 3] + spars) * al * (1 - al)
            layers[k, n, 3], ml[k, n, 3], vl[k, n, 3] = _step(layers[k, n, 3], ml[k, n, 3], vl[k, n, 3], g, lr_a, b1, b2, cs1, cs2)
            layers[k, n, 3] = min(max(layers[k, n, 3], np.float32(-9)), np.float32(9))
            falpha[k, n], mfa[k, n], vfa[k, n] = _step(falpha[k, n], mfa[k, n], vfa[k, n], g, lr_fa, b1, b2, cd1, cd2)
            falpha[k, n] *= dec_f
            for q in range(4):
                g0[k, n, q] = 0
                g1[k, n, q] = 0
        if any_:
            for q in range(3):
                base[k, q], mb[k, q], vb[k, q] = _step(base[k, q], mb[k, q], vb[k, q], s[q], lr, b1, b2, cs1, cs2)
                base[k, q] = min(max(base[k, q], np.float32(0)), np.float32(1))
                fbase[k, q], mfb[k, q], vfb[k, q] = _step(fbase[k, q], mfb[k, q], vfb[k, q], s[q], lr_f, b1, b2, cd1, cd2)
                fbase[k, q] *= dec_f
