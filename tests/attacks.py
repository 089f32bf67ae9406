"""Attacks on the error bound: clips made to break it, with errors measured independently.

`Attack` describes a clip by a few numbers: its hierarchy, rest pose, scale, position, and motions that no plant makes.
`broken_promises` encodes and decodes it and returns violations: of the bound in every frame of every vertex, of the
error that the file states for each level and segment, of the rest pose, and refusals without reason. Distances are
measured here, in units of the bound, so that nothing overflows or underflows. Attacks are drawn by hypothesis,
which also minimises those that succeed.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from hypothesis import strategies as st
from plants import subtree

import athcodec
from athcodec import MotionClip, Thresholds
from athcodec.decoding.container import SOURCE_REST
from athcodec.encoding.model.quantise import SOURCE_REST_TOLERANCE
from athcodec.errors import BoundError
from athcodec.motion.clip import LARGEST_COORDINATE

HIERARCHIES = ("random", "chain", "bush", "roots", "one")
RESTS = ("grown", "unrelated", "point", "line", "plane", "lattice", "scales")
ACTIONS = tuple(
    "spike,flicker,step,explode,collapse,shuffle,walk,lattice,leave,mirror,flatten,noise,spin,swap axes".split(",")
)


@dataclass(frozen=True)
class Attack:
    """A clip described by a few numbers."""

    seed: int = 0
    branches: int = 3
    longest: int = 4
    hierarchy: str = "random"
    rest: str = "grown"
    actions: tuple[str, ...] = ()
    frames: int = 20
    scale: float = 1.0  # Factor of all coordinates.
    squeeze: float = 1.0  # Factor of one axis against the others.
    place: float = 0.0  # distance from the origin, in sizes of the plant
    is_float64: bool = False
    shuffled: bool = False  # vertices in random order
    bound: float = 1e-3  # Bound over the diagonal.
    segment_frames: int = 64
    effort: str = "fast"
    exact_rest: bool = False
    tam: tuple[float, int, float, int] | None = None  # lengths as fractions of the diagonal

    def clip(self) -> MotionClip:
        """The clip; rounding of positions to their type is the last step."""
        rng = np.random.default_rng(self.seed)
        labels, parents = _hierarchy(rng, self.hierarchy, self.branches, self.longest)
        rest = _rest(rng, self.rest, labels, parents)
        positions = np.repeat(rest[None], self.frames, axis=0)
        if self.rest == "unrelated":
            rest = rng.normal(size=rest.shape) * 10.0 ** rng.uniform(-3, 3)
        some = subtree(parents, int(rng.integers(len(parents))))[labels]
        with np.errstate(over="ignore", invalid="ignore"):
            for action in self.actions:
                positions = _act(rng, action, positions, some)
            shape = np.array([self.squeeze, 1.0, 1.0])[rng.permutation(3)]
            corner = self.place * rng.choice([-1.0, 1.0], 3) * max(float(np.ptp(positions)), 1e-3)
            rest, positions = ((points * shape + corner) * self.scale for points in (rest, positions))
        limit = 0.99 * LARGEST_COORDINATE
        rest, positions = (np.clip(np.nan_to_num(points, nan=0.0), -limit, limit) for points in (rest, positions))
        order = rng.permutation(len(labels)) if self.shuffled else np.arange(len(labels))
        dtype = np.float64 if self.is_float64 else np.float32
        return MotionClip(
            positions=positions[:, order].astype(dtype),
            rest=rest[order].astype(dtype),
            time=np.arange(self.frames) / 30,
            vertex_branch=labels[order],
            branch_parent=parents,
        )

    def options(self, clip: MotionClip) -> dict:
        """Keywords of encode(), with a bound in scene units."""
        size = extent(clip) or 1.0
        tam = self.tam and Thresholds(self.tam[0] * size, self.tam[1], self.tam[2] * size, self.tam[3])
        kept = {name: getattr(self, name) for name in ("segment_frames", "effort", "exact_rest")}
        return kept | {"max_error": self.bound * size, "tam": tam}


def extent(clip: MotionClip) -> float:
    """Diagonal of the box around all frames."""
    return math.hypot(*np.ptp(clip.positions.reshape(-1, 3).astype(np.float64), axis=0))


def _hierarchy(rng, kind: str, branches: int, longest: int) -> tuple[np.ndarray, np.ndarray]:
    if kind == "one":
        branches = 1
    index = np.arange(branches)
    parents = {
        "random": np.array([-1, *(rng.integers(0, b) for b in range(1, branches))]),
        "chain": index - 1,
        "bush": np.where(index, 0, -1),
        "roots": np.full(branches, -1),
        "one": index - 1,
    }[kind]
    return np.repeat(index, rng.integers(1, longest + 1, branches)), parents.astype(np.int64)


def _rest(rng, kind: str, labels: np.ndarray, parents: np.ndarray) -> np.ndarray:
    steps = rng.normal(size=(len(labels), 3)) + [0.0, 0.0, 1.0]
    if kind == "point":
        return np.zeros_like(steps)
    if kind == "line":
        return np.cumsum(np.abs(steps[:, :1]) * rng.normal(size=3), axis=0)
    if kind == "plane":
        return np.cumsum(steps * [1.0, 0.0, 1.0], axis=0)
    if kind == "lattice":
        return np.rint(np.cumsum(steps, axis=0))
    if kind == "scales":  # neighbours twelve orders of magnitude apart
        return steps * 10.0 ** rng.uniform(-9, 3, (len(labels), 1))
    rest, first = np.zeros_like(steps), np.searchsorted(labels, np.arange(len(parents)))
    for branch, parent in enumerate(parents):
        mine = labels == branch
        start = rest[first[parent]] if parent >= 0 else 3 * rng.normal(size=3)
        rest[mine] = start + np.cumsum(0.3 * steps[mine], axis=0)
    return rest


def _act(rng, action: str, positions: np.ndarray, some: np.ndarray) -> np.ndarray:
    """Applies an action to the subtree `some` or to all vertices, in all frames or from a random one on."""
    frames, count, _ = positions.shape
    size, late = float(np.ptp(positions)) + 1e-3, slice(int(rng.integers(frames)), None)
    moved = positions.copy()
    time_ = np.arange(frames)[:, None, None]
    if action == "spike":
        for _ in range(rng.integers(1, 4)):
            moved[rng.integers(frames), rng.integers(count)] += size * rng.normal(size=3) * 10.0 ** rng.uniform(-3, 6)
    elif action == "flicker":
        moved[::2, some] += size * rng.normal(size=3)
    elif action == "step":
        moved[late, some] += size * 10.0 ** rng.uniform(-4, 2) * rng.normal(size=3)
    elif action == "explode":
        moved[:, some] = moved[:, some] * rng.uniform(1.01, 1.5) ** time_
    elif action == "collapse":
        moved[late] = moved[late].mean(axis=1, keepdims=True)
    elif action == "shuffle":
        moved[late] = moved[late][:, rng.permutation(count)]
    elif action == "walk":
        moved += np.cumsum(rng.normal(size=moved.shape), axis=0) * size * 0.01
    elif action == "lattice":
        step = size * 10.0 ** rng.uniform(-5, -1)
        moved = np.rint((moved + rng.normal(size=moved.shape) * step) / step * 2) * step / 2
    elif action == "leave":
        moved += np.linspace(0, 10.0 ** rng.uniform(0, 6), frames)[:, None, None] * size * rng.normal(size=3)
    elif action in ("mirror", "flatten"):
        centre = moved[late][:, some].mean(axis=1, keepdims=True)
        axis = np.where(np.arange(3) == rng.integers(3), -1.0 if action == "mirror" else 0.0, 1.0)
        moved[late, some] = (moved[late][:, some] - centre) * axis + centre
    elif action == "noise":
        moved += rng.normal(size=moved.shape) * size * 10.0 ** rng.uniform(-6, 0)
    elif action == "spin":
        angle = time_[..., 0] * rng.uniform(0, 3.2)
        x, y = moved[..., 0], moved[..., 1]
        moved[..., 0], moved[..., 1] = np.cos(angle) * x - np.sin(angle) * y, np.sin(angle) * x + np.cos(angle) * y
    elif action == "swap axes":
        moved[late, some] = moved[late][:, some][..., rng.permutation(3)]
    return moved


# ---- checks ----


def broken_promises(attack: Attack, folder: Path) -> list[str]:
    """Descriptions of every violation by encode() or the file; empty if there is none."""
    clip = attack.clip()
    options = attack.options(clip)
    try:
        summary = athcodec.encode(clip, folder / "attack.ath", **options)
    except BoundError as error:
        return [] if _may_be_refused(clip, options["max_error"]) else [f"refused without reason: {error}"]
    with athcodec.open(summary.path, strict=True) as decoder:
        decoder.file.check()
        return list(_broken(decoder, clip, options["max_error"], attack))


def _may_be_refused(clip: MotionClip, bound: float) -> bool:
    """Bounds below 1e-35 or twice the spacing of the source's numbers, or 2^28 times smaller than the extent."""
    both = np.concatenate([clip.positions.reshape(-1, 3), clip.rest]).astype(np.float64)
    spacing = float(np.spacing(np.abs(clip.positions).max()))
    return bound <= max(2 * spacing, 1e-35) or math.hypot(*np.ptp(both, axis=0)) > 2.0**28 * bound


def distances(decoded: np.ndarray, source: np.ndarray, unit: float) -> np.ndarray:
    """Distances of vertices, in units."""
    return np.linalg.norm((decoded.astype(np.float64) - source.astype(np.float64)) / unit, axis=-1)


def _broken(decoder: athcodec.Decoder, clip: MotionClip, bound: float, attack: Attack):
    source = clip.positions
    if decoder.file.max_error_bound > bound:
        yield f"the file promises {decoder.file.max_error_bound}, not {bound}"
    for level in range(decoder.file.level_count):
        off = distances(decoder.positions(level=level), source, bound)
        stated = decoder.file.errors[level, :, 0] / bound
        for segment, (start, stop) in enumerate(decoder.segments):
            worst = off[start:stop].max()
            if not worst <= stated[segment] * (1 + 1e-6) + 1e-9:
                yield f"level {level}, segment {segment}: stated {stated[segment]}, got {worst} bounds"
        if level == decoder.file.level_count - 1 and not off.max() <= 1.0:
            frame, vertex = np.unravel_index(np.argmax(off), off.shape)
            yield f"frame {frame}, vertex {vertex}: {off.max()} bounds off"
    frame = attack.seed % clip.frame_count
    if not np.array_equal(decoder.positions(frame), decoder.positions()[frame]):
        yield f"frame {frame} alone is another"
    if attack.exact_rest:
        if decoder.file.rest.tobytes() != clip.rest.astype(clip.rest_dtype).tobytes():
            yield "the exact rest pose has changed"
    elif not distances(decoder.file.rest, clip.rest, bound).max() <= _rest_limit(decoder, clip, bound):
        yield f"the rest pose is {distances(decoder.file.rest, clip.rest, bound).max()} bounds off"


def _rest_limit(decoder: athcodec.Decoder, clip: MotionClip, bound: float) -> float:
    """In bounds: more where the rest pose has a chunk of its own."""
    limit = 1.0 + 1e-6
    if decoder.file.chunks.find(SOURCE_REST):
        low, high = clip.positions.min(axis=(0, 1)), clip.positions.max(axis=(0, 1))
        limit *= max(1.0, SOURCE_REST_TOLERANCE * float(np.linalg.norm(high.astype(float) - low)) / bound)
    return limit + _rounding(clip, bound)


def _rounding(clip: MotionClip, bound: float) -> float:
    """Error by rounding a rest pose to its own type, in bounds; it can be further out than the motion."""
    return 2.0 * float(np.spacing(np.abs(clip.rest).max().astype(clip.rest_dtype))) / bound


# ---- many attacks ----

SCALES = (1.0, 1e-200, 1e-38, 1e-30, 1e-9, 1e-6, 1e-3, 1e3, 1e6, 1e12, 1e16)


@st.composite
def attacks(draw, **fixed) -> Attack:
    """Attacks with all fields drawn but the fixed ones. The simplest value comes first in each choice."""
    drawn = dict(
        seed=draw(st.integers(0, 10**6)),
        branches=draw(st.integers(1, 12)),
        longest=draw(st.sampled_from([1, 2, 3, 8, 70])),
        hierarchy=draw(st.sampled_from(HIERARCHIES)),
        rest=draw(st.sampled_from(RESTS)),
        actions=tuple(draw(st.lists(st.sampled_from(ACTIONS), max_size=3))),
        frames=draw(st.sampled_from([1, 2, 3, 15, 16, 17, 31, 33, 64, 100])),
        scale=draw(st.sampled_from(SCALES)),
        squeeze=draw(st.sampled_from([1.0, 1e-6, 1e3, 0.0])),
        place=draw(st.sampled_from([0.0, 1.0, 1e3, 1e5])),
        is_float64=draw(st.booleans()),
        shuffled=draw(st.booleans()),
        bound=draw(st.sampled_from([1e-3, 1e-1, 1.0, 10.0, 1e-2, 1e-4, 1e-5, 1e-6])),
        segment_frames=draw(st.integers(16, 256)),
        effort=draw(st.sampled_from(["fast", "default", "best"])),
        exact_rest=draw(st.booleans()),
        tam=draw(st.sampled_from([None, (0.0, 0, 0.0, 0), (10.0, 0, 10.0, 0), (0.01, 2, 0.02, 3), (0.0, 9, 0.0, 99)])),
    )
    return Attack(**drawn | fixed)


LARGE = {
    "1,000 branches on one stem": Attack(branches=1001, longest=3, hierarchy="bush", frames=12, actions=("walk",)),
    "a chain of 2,000 branches": Attack(branches=2000, longest=1, hierarchy="chain", frames=6, actions=("walk",)),
    "a chain of 2,000 that shuffles": Attack(
        branches=2000, longest=2, hierarchy="chain", frames=4, actions=("shuffle", "mirror")
    ),
    "600 frames in one vertex": Attack(
        hierarchy="one", longest=1, frames=600, actions=("walk", "spike"), segment_frames=256
    ),
    "a stem of 3,000 vertices": Attack(hierarchy="one", longest=6000, seed=1, frames=6, actions=("noise", "flatten")),
    "1,000 roots": Attack(branches=1000, hierarchy="roots", frames=8, actions=("leave", "flicker")),
}
