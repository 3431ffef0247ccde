"""Rigid-body kernels on preallocated records: allocation-free, O(n) but for the mass matrix.

Every kernel takes an `arm` (see `arm_record`) and a `motion` (see `motion_record`), both as single records, and leaves
its result in the fields of `motion` or in an output array. Quantities of a link are expressed in the link's own frame,
about its origin; `R`, `o` and `z` are in the base frame.

Spatial vectors after R. Featherstone, "Rigid Body Dynamics Algorithms", Springer 2008, doi:10.1007/978-1-4899-7560-7.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tactful._njit import njit

Array = np.ndarray[Any, np.dtype[np.float64]]


@njit(cache=True)
def copy(x: Array, y: Array) -> None:
    """Set y = x, which compiles in a tenth of the time that y[:] = x takes."""
    for i in range(y.shape[0]):
        y[i] = x[i]


@njit(cache=True)
def _rotate(E: Array, x: Array, y: Array) -> None:
    """Set y = E x."""
    for i in range(3):
        y[i] = E[i, 0] * x[0] + E[i, 1] * x[1] + E[i, 2] * x[2]


@njit(cache=True)
def _rotate_back(E: Array, x: Array, y: Array) -> None:
    """Set y = E^T x."""
    for i in range(3):
        y[i] = E[0, i] * x[0] + E[1, i] * x[1] + E[2, i] * x[2]


@njit(cache=True)
def _dot(x: Array, y: Array) -> float:
    """Return x . y."""
    return x[0] * y[0] + x[1] * y[1] + x[2] * y[2]  # type: ignore[no-any-return]


@njit(cache=True)
def _triple(x: Array, y: Array, z: Array) -> float:
    """Return (x x y) . z."""
    return (  # type: ignore[no-any-return]
        (x[1] * y[2] - x[2] * y[1]) * z[0] + (x[2] * y[0] - x[0] * y[2]) * z[1] + (x[0] * y[1] - x[1] * y[0]) * z[2]
    )


@njit(cache=True)
def _add_cross(x: Array, y: Array, z: Array) -> None:
    """Set z = z + x x y."""
    z[0] += x[1] * y[2] - x[2] * y[1]
    z[1] += x[2] * y[0] - x[0] * y[2]
    z[2] += x[0] * y[1] - x[1] * y[0]


@njit(cache=True)
def place(arm: Any, motion: Any, q: Array) -> None:
    """Place all links: E, d, R, o and z of `motion` from the joint positions q (n,)."""
    for i in range(q.shape[0]):
        E, d, R, o, z = motion.E[i], motion.d[i], motion.R[i], motion.o[i], motion.z[i]
        sin, versin = np.sin(q[i]), 1.0 - np.cos(q[i])
        for r in range(3):
            for c in range(3):
                E[r, c] = arm.rotation_0[i, r, c] + sin * arm.rotation_sin[i, r, c] + versin * arm.rotation_cos[i, r, c]
            d[r] = arm.translation[i, r]
        if arm.prismatic[i]:
            for r in range(3):
                d[r] += q[i] * (E[r, 0] * arm.axis[i, 0] + E[r, 1] * arm.axis[i, 1] + E[r, 2] * arm.axis[i, 2])
        if i == 0:
            for r in range(3):
                copy(E[r], R[r])
            copy(d, o)
        else:
            P = motion.R[i - 1]
            for r in range(3):
                for c in range(3):
                    R[r, c] = P[r, 0] * E[0, c] + P[r, 1] * E[1, c] + P[r, 2] * E[2, c]
            _rotate(P, d, o)
            for r in range(3):
                o[r] += motion.o[i - 1, r]
        _rotate(R, arm.axis[i], z)


@njit(cache=True)
def _link_velocity(arm: Any, motion: Any, i: int, dq: Array) -> None:
    """Set w and v of link i from those of link i - 1."""
    E, w, v, axis = motion.E[i], motion.w[i], motion.v[i], arm.axis[i]
    if i == 0:
        w[:] = 0.0
        v[:] = 0.0
    else:
        _rotate_back(E, motion.w[i - 1], w)
        swept = motion.dw[i]  # scratch: velocity of this origin as a point of the parent
        copy(motion.v[i - 1], swept)
        _add_cross(motion.w[i - 1], motion.d[i], swept)
        _rotate_back(E, swept, v)
    moving = v if arm.prismatic[i] else w
    for r in range(3):
        moving[r] += axis[r] * dq[i]


@njit(cache=True)
def _to_parent(motion: Any, i: int, k: Array, force: Array) -> None:
    """Add the moment k[i] and the force[i] of link i to those of link i - 1."""
    E, d = motion.E[i], motion.d[i]
    f0 = E[0, 0] * force[i, 0] + E[0, 1] * force[i, 1] + E[0, 2] * force[i, 2]
    f1 = E[1, 0] * force[i, 0] + E[1, 1] * force[i, 1] + E[1, 2] * force[i, 2]
    f2 = E[2, 0] * force[i, 0] + E[2, 1] * force[i, 1] + E[2, 2] * force[i, 2]
    force[i - 1, 0] += f0
    force[i - 1, 1] += f1
    force[i - 1, 2] += f2
    k[i - 1, 0] += E[0, 0] * k[i, 0] + E[0, 1] * k[i, 1] + E[0, 2] * k[i, 2] + d[1] * f2 - d[2] * f1
    k[i - 1, 1] += E[1, 0] * k[i, 0] + E[1, 1] * k[i, 1] + E[1, 2] * k[i, 2] + d[2] * f0 - d[0] * f2
    k[i - 1, 2] += E[2, 0] * k[i, 0] + E[2, 1] * k[i, 1] + E[2, 2] * k[i, 2] + d[0] * f1 - d[1] * f0


@njit(cache=True)
def momentum_terms(arm: Any, motion: Any, dq: Array) -> None:
    r"""Compute p = M dq, C^T dq and g without M and without C, after `place`.

    With H_i the spatial momentum of the subtree of link i, v_i the spatial velocity of link i, W_i the wrench of
    gravity on that subtree and S_i the joint's motion subspace,

        p_i = S_i . H_i,    (C^T dq)_i = dT/dq_i = (v_i x S_i) . H_i,    g_i = -S_i . W_i.

    One outward and one inward pass. C is the matrix of the Christoffel symbols, for which dM/dt = C + C^T.
    """
    n = dq.shape[0]
    for i in range(n):
        _link_velocity(arm, motion, i, dq)
        w, v, a, h, mass = motion.w[i], motion.v[i], motion.a[i], arm.first_moment[i], arm.mass[i]
        if i == 0:
            _rotate_back(motion.E[i], arm.gravity, a)
        else:
            _rotate_back(motion.E[i], motion.a[i - 1], a)
        k, l, gk, gl = motion.k[i], motion.l[i], motion.gk[i], motion.gl[i]  # noqa: E741
        _rotate(arm.inertia[i], w, k)
        _add_cross(h, v, k)
        gk[:] = 0.0
        _add_cross(h, a, gk)
        for r in range(3):
            l[r] = mass * v[r]
            gl[r] = mass * a[r]
        _add_cross(w, h, l)
    for i in range(n - 1, -1, -1):
        w, v, k, l, axis = motion.w[i], motion.v[i], motion.k[i], motion.l[i], arm.axis[i]  # noqa: E741
        if arm.prismatic[i]:
            motion.p[i] = _dot(axis, l)
            motion.ctdq[i] = _triple(w, axis, l)
            motion.g[i] = -_dot(axis, motion.gl[i])
        else:
            motion.p[i] = _dot(axis, k)
            motion.ctdq[i] = _triple(w, axis, k) + _triple(v, axis, l)
            motion.g[i] = -_dot(axis, motion.gk[i])
        motion.p[i] += arm.motor_inertia[i] * dq[i]
        if i > 0:
            _to_parent(motion, i, motion.k, motion.l)
            _to_parent(motion, i, motion.gk, motion.gl)


@njit(cache=True)
def inverse_dynamics(arm: Any, motion: Any, dq: Array, ddq: Array, tau: Array) -> None:
    """Set tau = M ddq + C dq + g by the recursive Newton-Euler algorithm, after `place`."""
    n = dq.shape[0]
    for i in range(n):
        _link_velocity(arm, motion, i, dq)
        E, axis, w, v, a, dw = motion.E[i], arm.axis[i], motion.w[i], motion.v[i], motion.a[i], motion.dw[i]
        if i == 0:
            dw[:] = 0.0
            _rotate_back(E, arm.gravity, a)
            for r in range(3):
                a[r] = -a[r]
        else:
            # Spatial acceleration, a = d/dt v as a field; gravity enters as an upward acceleration of the base.
            swept = motion.gl[i]
            copy(motion.a[i - 1], swept)
            _add_cross(motion.dw[i - 1], motion.d[i], swept)
            _rotate_back(E, swept, a)
            _rotate_back(E, motion.dw[i - 1], dw)
        if arm.prismatic[i]:
            for r in range(3):
                a[r] += axis[r] * ddq[i]
            swept = motion.gk[i]
            for r in range(3):
                swept[r] = axis[r] * dq[i]
            _add_cross(w, swept, a)
        else:
            for r in range(3):
                dw[r] += axis[r] * ddq[i]
            swept = motion.gk[i]
            for r in range(3):
                swept[r] = axis[r] * dq[i]
            _add_cross(w, swept, dw)
            _add_cross(v, swept, a)
        # f = I a + v x* (I v) with I v = (k, l).
        h, mass, f, m = arm.first_moment[i], arm.mass[i], motion.gl[i], motion.gk[i]
        k, l = motion.k[i], motion.l[i]  # noqa: E741
        _rotate(arm.inertia[i], w, k)
        _add_cross(h, v, k)
        for r in range(3):
            l[r] = mass * v[r]
        _add_cross(w, h, l)
        _rotate(arm.inertia[i], dw, m)
        _add_cross(h, a, m)
        _add_cross(w, k, m)
        _add_cross(v, l, m)
        for r in range(3):
            f[r] = mass * a[r]
        _add_cross(dw, h, f)
        _add_cross(w, l, f)
    for i in range(n - 1, -1, -1):
        tau[i] = _dot(arm.axis[i], motion.gl[i] if arm.prismatic[i] else motion.gk[i])
        tau[i] += arm.motor_inertia[i] * ddq[i]
        if i > 0:
            _to_parent(motion, i, motion.gk, motion.gl)


@njit(cache=True)
def mass_matrix(arm: Any, motion: Any, M: Array) -> None:
    """Set the mass matrix M (n, n) by the composite-rigid-body algorithm, after `place`."""
    n = M.shape[0]
    copy(arm.mass, motion.Im)
    for i in range(n):
        copy(arm.first_moment[i], motion.Ih[i])
        for r in range(3):
            copy(arm.inertia[i, r], motion.II[i, r])
    for j in range(n - 1, -1, -1):
        axis, k, f = arm.axis[j], motion.k, motion.l
        mass, h, inertia = motion.Im[j], motion.Ih[j], motion.II[j]
        if arm.prismatic[j]:
            k[j, :] = 0.0
            _add_cross(h, axis, k[j])
            for r in range(3):
                f[j, r] = mass * axis[r]
        else:
            _rotate(inertia, axis, k[j])
            f[j, :] = 0.0
            _add_cross(axis, h, f[j])
        for i in range(j, -1, -1):
            M[i, j] = M[j, i] = _dot(arm.axis[i], f[i] if arm.prismatic[i] else k[i])
            if i > 0:
                k[i - 1, :] = 0.0
                f[i - 1, :] = 0.0
                _to_parent(motion, i, k, f)
        M[j, j] += arm.motor_inertia[j]
        if j > 0:
            _compose(motion, j)


@njit(cache=True)
def _compose(motion: Any, j: int) -> None:
    """Add the composite body of link j to that of link j - 1."""
    E, d, mass, inertia = motion.E[j], motion.d[j], motion.Im[j], motion.II[j]
    h = motion.a[j]
    _rotate(E, motion.Ih[j], h)
    turned = motion.turned
    for r in range(3):
        for c in range(3):
            turned[r, c] = inertia[r, 0] * E[c, 0] + inertia[r, 1] * E[c, 1] + inertia[r, 2] * E[c, 2]
    # I' = E I E^T + (2 h.d + m d.d) 1 - h d^T - d h^T - m d d^T, with h the first moment in the parent's axes.
    trace = 2.0 * _dot(h, d) + mass * _dot(d, d)
    for r in range(3):
        for c in range(3):
            motion.II[j - 1, r, c] += (
                E[r, 0] * turned[0, c]
                + E[r, 1] * turned[1, c]
                + E[r, 2] * turned[2, c]
                - h[r] * d[c]
                - d[r] * h[c]
                - mass * d[r] * d[c]
            )
        motion.II[j - 1, r, r] += trace
        motion.Ih[j - 1, r] += h[r] + mass * d[r]
    motion.Im[j - 1] += mass


@njit(cache=True)
def tip_position(arm: Any, motion: Any, x: Array) -> None:
    """Set x (3,) to the position of the tip in the base, after `place` [m]."""
    link = arm.tip_link
    if link < 0:
        copy(arm.tip_translation, x)
    else:
        _rotate(motion.R[link], arm.tip_translation, x)
        for r in range(3):
            x[r] += motion.o[link, r]


@njit(cache=True)
def jacobian(arm: Any, motion: Any, link: int, x: Array, J: Array) -> None:
    """Set J (6, n): velocity [m/s] and angular velocity [rad/s] of link `link` at the point x (3,), base axes."""
    for i in range(J.shape[1]):
        z = motion.z[i]
        if i > link:
            for r in range(6):
                J[r, i] = 0.0
        elif arm.prismatic[i]:
            for r in range(3):
                J[r, i] = z[r]
                J[r + 3, i] = 0.0
        else:
            a0, a1, a2 = x[0] - motion.o[i, 0], x[1] - motion.o[i, 1], x[2] - motion.o[i, 2]
            J[0, i] = z[1] * a2 - z[2] * a1
            J[1, i] = z[2] * a0 - z[0] * a2
            J[2, i] = z[0] * a1 - z[1] * a0
            for r in range(3):
                J[r + 3, i] = z[r]
