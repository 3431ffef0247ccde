"""One update of the evidence grid: from a placed arm and its external torque to the posterior, in one kernel."""

from __future__ import annotations

from typing import Any

import numpy as np

from tactful._njit import njit
from tactful.dynamics.kernels import copy
from tactful.isolation._evidence import Array, add_moment, force, score, whiten, whiten_link

_NEGLIGIBLE = 12.0
"""Natural logarithm of the ratio to the best cell below which a cell is not refined."""
_FEW = 0.01
"""Share of the best point's probability below which a point, or a magnitude, does not count for the force."""


@njit(cache=True)
def _inform(arm: Any, motion: Any, links: Any, work: Any) -> None:
    """Set what the torque says of a wrench on each link."""
    U, y = work.U, work.y
    work.square = 0.0
    for i in range(y.shape[0]):
        work.square += y[i] * y[i]
    for i in range(links.shape[0]):
        link = links[i]
        link.informed = -1
        whiten_link(arm, motion, i, work.V, U)
        P, g = link.P_exact, link.g_exact
        for r in range(6):
            for s in range(r + 1):
                total = 0.0
                for k in range(i + 1):
                    total += U[k, r] * U[k, s]
                P[r, s] = P[s, r] = total
            total = 0.0
            for k in range(i + 1):
                total += U[k, r] * y[k]
            g[r] = total


@njit(cache=True)
def _blur(link: Any, level: int, work: Any) -> None:
    """Add the moment that the force makes within the reach of a point, for each magnitude, unless that is done."""
    if link.informed >= level:
        return
    link.informed = level
    for j in range(work.magnitudes.shape[0]):
        moment = work.magnitudes[j] * link.spread[level]
        added, explained = add_moment(
            link.P_exact, link.g_exact, moment * moment, link.P[level, j], link.g[level, j], work.K, work.CK
        )
        link.exponent[level, j] = work.square - explained
        link.log_det[level, j] = work.log_det + added


@njit(cache=True)
def _tangential(link: Any, level: int, work: Any) -> float:
    """Return the variance of each tangential component of the force over the squared magnitude."""
    return 0.25 * work.friction * work.friction + link.turn[level] * link.turn[level]  # type: ignore[no-any-return]


@njit(cache=True)
def _log_evidence(x: Array, link: Any, level: int, parts: Array, work: Any) -> float:
    """Return the log evidence of a point, averaged over the magnitudes, each of which it leaves in `parts`.

    Notes the least exponent and the largest part. A point that falls far behind that is left out, for -inf.
    """
    tangential = _tangential(link, level, work)
    count = work.magnitudes.shape[0]
    bound = -np.inf  # det >= 1
    for j in range(count):
        m = work.magnitudes[j]
        exponent, det = score(x, link.P[level, j], link.g[level, j], m, 0.25 * m * m, tangential * m * m)
        exponent += link.exponent[level, j]
        work.dets[j] = det
        parts[j] = -0.5 * (exponent + link.log_det[level, j])
        bound = max(bound, parts[j])
        if exponent < work.misfit:
            work.misfit = exponent
    if bound < work.peak - 3.0 * _NEGLIGIBLE:
        return -np.inf
    best = -np.inf
    for j in range(count):
        parts[j] -= 0.5 * np.log(work.dets[j])
        best = max(best, parts[j])
    work.peak = max(work.peak, best)
    total = 0.0
    for j in range(count):
        if parts[j] > best - _NEGLIGIBLE:
            total += np.exp(parts[j] - best)
    return best + np.log(total / count)  # type: ignore[no-any-return]


@njit(cache=True)
def _place(motion: Any, link: int, x: Array, placed: Array) -> None:
    """Set `placed` (3,) to the position of a point of a link in the base."""
    R, o = motion.R[link], motion.o[link]
    for r in range(3):
        placed[r] = o[r] + R[r, 0] * x[0] + R[r, 1] * x[1] + R[r, 2] * x[2]


@njit(cache=True)
def _place_capsules(motion: Any, capsules: Any) -> None:
    for k in range(capsules.shape[0]):
        capsule = capsules[k]
        start, axis = capsule.start, capsule.axis
        if capsule.link < 0:
            copy(capsule.ends[0], start)
            copy(capsule.ends[1], axis)
        else:
            _place(motion, capsule.link, capsule.ends[0], start)
            _place(motion, capsule.link, capsule.ends[1], axis)
        square = 0.0
        for r in range(3):
            axis[r] -= start[r]
            square += axis[r] * axis[r]
        capsule.inverse_square = 1.0 / square if square > 0.0 else 0.0


@njit(cache=True)
def _covered(motion: Any, x: Array, link: int, slack: float, capsules: Any, work: Any) -> bool:
    """Whether a point lies in a capsule of a neighbouring link, where nothing can touch it."""
    placed = work.x
    _place(motion, link, x, placed)
    for k in range(capsules.shape[0]):
        capsule = capsules[k]
        if capsule.link == link or capsule.link > link + 2 or capsule.link < link - 2:
            continue
        p, d = capsule.start, capsule.axis
        e0, e1, e2 = placed[0] - p[0], placed[1] - p[1], placed[2] - p[2]
        s = min(max((e0 * d[0] + e1 * d[1] + e2 * d[2]) * capsule.inverse_square, 0.0), 1.0)
        e0, e1, e2 = e0 - s * d[0], e1 - s * d[1], e2 - s * d[2]
        reach = capsule.radius - slack
        if reach > 0.0 and e0 * e0 + e1 * e1 + e2 * e2 < reach * reach:
            return True
    return False


@njit(cache=True)
def mark_coverable(motion: Any, cells: Any, capsules: Any, work: Any, margin: float) -> None:
    """Mark the cells that lie within a margin [m] of a neighbouring link in this pose."""
    _place_capsules(motion, capsules)
    for k in range(cells.shape[0]):
        if not cells[k].coverable and _covered(motion, cells[k].x, cells[k].link, -margin, capsules, work):
            cells[k].coverable = 1


@njit(cache=True)
def _coarse(motion: Any, cells: Any, capsules: Any, links: Any, work: Any) -> None:
    """Set the log of evidence times area of every cell, and the exposed area of every link."""
    for i in range(links.shape[0]):
        links[i].area = 0.0
        if links[i].spread[0] > 0.0:  # it has a surface
            _blur(links[i], 0, work)
    for k in range(cells.shape[0]):
        cell = cells[k]
        cell.refined = 0
        if cell.coverable and _covered(motion, cell.x, cell.link, work.slack, capsules, work):
            cell.log_p = -np.inf
        else:
            links[cell.link].area += cell.area
            cell.log_p = _log_evidence(cell.x, links[cell.link], 0, cell.parts, work)
    for k in range(cells.shape[0]):
        cell = cells[k]
        if cell.log_p > -np.inf:
            cell.log_p += np.log(cell.area / links[cell.link].area)


@njit(cache=True)
def _refine(motion: Any, cells: Any, fine: Any, capsules: Any, links: Any, atoms: Any, work: Any) -> int:
    """Fill the atoms and return how many there are; their `p` is a logarithm here."""
    count = 0
    best = -np.inf
    for _ in range(work.refined):
        top = -1
        for k in range(cells.shape[0]):
            if not cells[k].refined and (top < 0 or cells[k].log_p > cells[top].log_p):
                top = k
        if top < 0 or cells[top].log_p == -np.inf or cells[top].log_p < best - _NEGLIGIBLE:
            break
        cell = cells[top]
        cell.refined = 1
        best = max(best, cell.log_p)
        link = links[cell.link]
        _blur(link, 1, work)
        before = count
        for i in range(cell.start, cell.stop):
            if cell.coverable and _covered(motion, fine[i].x, cell.link, 0.0, capsules, work):
                continue
            atom = atoms[count]
            atom.link, atom.level, atom.index, atom.area = cell.link, 1, i, fine[i].area
            atom.p = _log_evidence(fine[i].x, link, 1, atom.parts, work)
            if atom.p > -np.inf:
                atom.p += np.log(fine[i].area / link.area)
                count += 1
        if count == before:  # a neighbour covers all of its fine points: it stays as it is
            cell.refined = 2
    for k in range(cells.shape[0]):
        cell = cells[k]
        if cell.refined != 1 and cell.log_p > best - 2.0 * _NEGLIGIBLE:
            atom = atoms[count]
            atom.link, atom.level, atom.index, atom.area, atom.p = cell.link, 0, k, cell.area, cell.log_p
            copy(cell.parts, atom.parts)
            count += 1
    return count


@njit(cache=True)
def _normalise(count: int, links: Any, atoms: Any, work: Any) -> int:
    """Turn the atoms' logarithms into probabilities, sum them up by link, and return the most probable link."""
    peak, total = -np.inf, 0.0
    for a in range(count):
        peak = max(peak, atoms[a].p)
    for i in range(links.shape[0]):
        links[i].p = 0.0
    for a in range(count):
        atoms[a].p = np.exp(atoms[a].p - peak)
        total += atoms[a].p
    for a in range(count):
        atoms[a].p /= total
        links[atoms[a].link].p += atoms[a].p
    work.log_evidence = peak + np.log(total / links.shape[0])
    best = 0
    for i in range(links.shape[0]):
        if links[i].p > links[best].p:
            best = i
    return best


@njit(cache=True)
def _add_force(x: Array, link: Any, level: int, share: float, parts: Array, work: Any) -> None:
    """Add the force at a point, over all magnitudes, to the sums, in the link's frame."""
    tangential = _tangential(link, level, work)
    f, K = work.f, work.K
    peak, total = -np.inf, 0.0
    for j in range(parts.shape[0]):
        peak = max(peak, parts[j])
    for j in range(parts.shape[0]):
        parts[j] = np.exp(parts[j] - peak)
        total += parts[j]
    for j in range(parts.shape[0]):
        weight = share * parts[j] / total
        if weight < _FEW * share:
            continue
        m = work.magnitudes[j]
        force(x, link.P[level, j], link.g[level, j], m, 0.25 * m * m, tangential * m * m, f, K)
        square = f[0] * f[0] + f[1] * f[1] + f[2] * f[2]
        along = 0.0
        for r in range(3):
            work.force[r] += weight * f[r]
            for s in range(3):
                work.force_cov[r, s] += weight * (f[r] * f[s] + K[r, s])
                along += f[r] * K[r, s] * f[s]
        work.size[0] += weight * np.sqrt(square)
        work.size[1] += weight * (square + along / max(square, 1e-12))


@njit(cache=True)
def _summarise(motion: Any, best: int, count: int, cells: Any, fine: Any, links: Any, atoms: Any, work: Any) -> None:
    """Place the atoms in the base, and sum up the point and the force of a contact on the best link."""
    link = links[best]
    work.size[0] = work.size[1] = 0.0
    for r in range(3):
        work.point[r] = work.force[r] = 0.0
        for s in range(3):
            work.point_cov[r, s] = work.force_cov[r, s] = 0.0
    top, mass = 0.0, 0.0
    for a in range(count):
        if atoms[a].link == best:
            top = max(top, atoms[a].p)
    for a in range(count):
        atom = atoms[a]
        if atom.link != best:
            continue
        x = fine[atom.index].x if atom.level else cells[atom.index].x
        _place(motion, best, x, atom.x)
        share = atom.p / link.p
        for r in range(3):
            work.point[r] += share * atom.x[r]
            work.point_cov[r, r] += share * link.spread[atom.level] ** 2
            for s in range(3):
                work.point_cov[r, s] += share * atom.x[r] * atom.x[s]
        if atom.p > _FEW * top:
            mass += share
            _add_force(x, link, atom.level, share, atom.parts, work)
    for r in range(3):
        work.force[r] /= mass
    work.size[0] /= mass
    work.size[1] = max(work.size[1] / mass - work.size[0] * work.size[0], 0.0)
    for r in range(3):
        for s in range(3):
            work.point_cov[r, s] -= work.point[r] * work.point[s]
            work.force_cov[r, s] = work.force_cov[r, s] / mass - work.force[r] * work.force[s]
    _turn(motion.R[best], work.force, work.force_cov, work.f, work.K)


@njit(cache=True)
def _turn(R: Array, f: Array, S: Array, old: Array, RS: Array) -> None:
    """Set f <- R f and S <- R S R^T."""
    copy(f, old)
    for r in range(3):
        f[r] = R[r, 0] * old[0] + R[r, 1] * old[1] + R[r, 2] * old[2]
        for s in range(3):
            RS[r, s] = R[r, 0] * S[0, s] + R[r, 1] * S[1, s] + R[r, 2] * S[2, s]
    for r in range(3):
        for s in range(3):
            S[r, s] = RS[r, 0] * R[s, 0] + RS[r, 1] * R[s, 1] + RS[r, 2] * R[s, 2]


@njit(cache=True)
def locate(
    arm: Any,
    motion: Any,
    tau: Array,
    Sigma: Array,
    cells: Any,
    fine: Any,
    capsules: Any,
    links: Any,
    atoms: Any,
    work: Any,
) -> tuple[int, int]:
    """Find the posterior of a contact, after `place`; see `Grid` for the records.

    Returns:
        The most probable link and the number of atoms; -1 where Sigma is not positive definite.
    """
    log_det = whiten(Sigma, tau, work.V, work.y)
    if not np.isfinite(log_det):
        return -1, 0
    work.log_det = log_det
    _inform(arm, motion, links, work)
    _place_capsules(motion, capsules)
    work.peak, work.misfit = -np.inf, np.inf
    _coarse(motion, cells, capsules, links, work)
    work.peak, work.misfit = -np.inf, np.inf
    count = _refine(motion, cells, fine, capsules, links, atoms, work)
    best = _normalise(count, links, atoms, work)
    _summarise(motion, best, count, cells, fine, links, atoms, work)
    return best, count
