"""A leaf blade as a Kirchhoff plate of Morley elements (scikit-fem) that flutters in its lowest modes."""

from __future__ import annotations

from contextlib import chdir
from pathlib import Path

import meshio
import numpy as np
import skfem
from scipy.signal import lfilter
from skfem.helpers import dd, ddot, eye, trace

FRAMES, FPS, MODES = 200, 60.0, 12


def flutter(path: Path, seed: int, shape: float, refine: int) -> None:
    """Write an XDMF series, as meshio writes it, with the displacement of a fluttering leaf blade in every step.
    `shape` is the blade's width over its length, and `refine` how often its mesh is refined.
    """
    rng = np.random.default_rng(seed)
    grid = skfem.MeshTri.init_tensor(np.linspace(0, 1, 10 * refine + 1), np.linspace(-1, 1, 6 * refine + 1))
    along, across = grid.p
    width = shape * (0.05 + np.sqrt(along) * (1 - along) ** 0.6)
    grid = skfem.MeshTri(np.stack([along, across * width / 2 + 0.1 * along**2]), grid.t)
    stiff = np.exp(-3 * (np.abs(grid.p[1] - 0.1 * grid.p[0] ** 2)) / shape)  # The midrib.
    basis = skfem.Basis(grid, skfem.ElementTriMorley())
    thickness = skfem.Basis(grid, skfem.ElementTriP1(), quadrature=basis.quadrature).interpolate(stiff)

    @skfem.BilinearForm
    def bending(u, v, w):
        def moment(x):
            return 0.7 * dd(x) + 0.3 * eye(trace(dd(x)), 2)

        return (0.02 + w["t"] ** 3) * ddot(moment(u), dd(v))

    @skfem.BilinearForm
    def mass(u, v, w):
        return u * v

    clamped = basis.get_dofs(lambda x: x[0] < 1e-9)
    matrices = skfem.condense(bending.assemble(basis, t=thickness), mass.assemble(basis), D=clamped)
    start = np.ones(matrices[0].shape[0])  # Else ARPACK begins at random.
    squares, modes = skfem.solve(*matrices, solver=skfem.solver_eigen_scipy_sym(k=MODES, sigma=0.0, v0=start))
    shapes = modes[basis.nodal_dofs[0]]
    shapes /= np.abs(shapes).max(axis=0)
    hertz = 2.0 * np.sqrt(squares / squares[0])
    gusts = rng.normal(size=(MODES, FRAMES + 300))
    motion = np.stack([_swing(*pair) for pair in zip(gusts, hertz)])[:, 300:]
    motion *= 0.12 / hertz[:, None] * hertz[0] / motion.std(axis=1, keepdims=True)
    points = np.stack([*grid.p, 0.15 * grid.p[0] - 0.3 * grid.p[0] ** 2], axis=1)
    with chdir(path.parent), meshio.xdmf.TimeSeriesWriter(path.name) as writer:  # It writes arrays where it runs.
        writer.write_points_cells(points, [("triangle", grid.t.T)])
        for frame in range(FRAMES):
            displacement = np.zeros_like(points)
            displacement[:, 2] = shapes @ motion[:, frame]
            writer.write_data(frame / FPS, point_data={"displacement": displacement})


def _swing(force: np.ndarray, hertz: float) -> np.ndarray:
    """Return response of a damped oscillator to noise, sampled FPS times a second."""
    rate = 2 * np.pi * hertz / FPS
    decay = np.exp(-0.06 * rate)
    return lfilter([1.0], [1.0, -2 * decay * np.cos(rate), decay**2], force)
