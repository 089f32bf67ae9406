"""A turbulent wind: a mean that grows with height, and gusts with a von Karman spectrum that travel with it.

The gusts are a sum of plane waves across their wave vectors, so without divergence (Kraichnan, "Diffusion by
a random velocity field", Physics of Fluids 13(1), 1970), with the energy spectrum of von Karman ("Progress in
the statistical theory of turbulence", PNAS 34(11), 1948). The field is frozen and carried along (Taylor, "The
spectrum of turbulence", Proc. Royal Society A 164, 1938), so points near each other, and points one behind
the other at a delay, feel the same gust. It is isotropic, knows no ground, and no plant slows it down.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

DIRECTION = np.array([-1.0, 0.0, 1.0]) / np.sqrt(2.0)
PROFILE_EXPONENT = 0.2
WAVES = 192


@dataclass(frozen=True)
class Wind:
    """Mean speed (m/s) at `height` (m), turbulence intensity (of each component), integral length (m), and the time
    (s) after which it repeats, 0 for never.
    """

    speed: float
    height: float
    intensity: float = 0.25
    length: float = 15.0
    seed: int = 0
    period: float = 0.0

    def at(self, points: np.ndarray, time: float) -> np.ndarray:
        """Return (..., 3) velocities in m/s at (..., 3) points in metres, y up."""
        gusts = self._gusts(np.asarray(points, np.float32).reshape(-1, 3), time)
        profile = np.clip(np.asarray(points)[..., 1:2] / self.height, 0.0, None) ** PROFILE_EXPONENT
        return profile * self.speed * DIRECTION + gusts.reshape(np.shape(points)).astype(np.float64)

    def _gusts(self, points: np.ndarray, time: float) -> np.ndarray:
        waves, phases, amplitudes = self._waves
        # in float64 up to one turn: float32 phases would jump after some minutes
        offset = np.remainder(phases - time * self._rates, 2 * np.pi)
        return np.cos(points @ waves.T.astype(np.float32) + offset.astype(np.float32)) @ amplitudes

    @cached_property
    def _rates(self) -> np.ndarray:
        """(K,) radians per second at a place that stands still; where the wind repeats, whole turns per period."""
        rates = self.speed * (self._waves[0] @ DIRECTION)
        turn = 2 * np.pi / self.period if self.period > 0 else 0.0
        return turn * np.round(rates / turn) if turn else rates

    @cached_property
    def _waves(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Return the waves that the gusts are summed from, one per equal step of the logarithm of the wave number: wave
        vectors (K, 3), phases (K,), and amplitudes (K, 3).
        """
        rng = np.random.default_rng(self.seed)
        scale = 1.339 * self.length
        edges = np.geomspace(0.05 / scale, max(300.0 / scale, 60.0 / self.speed), WAVES + 1)
        number = edges[:-1] * (edges[1:] / edges[:-1]) ** rng.uniform(size=WAVES)
        energy = (number * scale) ** 4 / (1 + (number * scale) ** 2) ** (17 / 6) * np.diff(edges)
        energy *= 1.5 * (self.intensity * self.speed) ** 2 / energy.sum()
        waves = _unit(rng.normal(size=(WAVES, 3)))
        across = _unit(np.cross(waves, rng.normal(size=(WAVES, 3))))
        amplitudes = across * 2 * np.sqrt(energy)[:, None]
        return waves * number[:, None], rng.uniform(0, 2 * np.pi, WAVES), amplitudes.astype(np.float32)


def _unit(vectors: np.ndarray) -> np.ndarray:
    return vectors / np.linalg.norm(vectors, axis=1, keepdims=True)
