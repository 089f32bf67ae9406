"""Nodes and animations of a glTF file, evaluated: the matrices of all nodes, and morph weights, at any times.

Follows the glTF 2.0 specification: STEP, LINEAR (rotations along the shorter arc) and CUBICSPLINE, values held before
the first key and after the last. KHR_animation_pointer may address transforms, weights and visibility of nodes, and
weights of meshes, all of them or a single one; `unplayed` names what else it addresses. Matrices of many frames are
made at once. It knows no vertices (gltf.py).
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from athcodec.errors import ClipError
from athcodec.files.gltf.document import GltfFile
from athcodec.files.gltf.json import brief, entries, entry, extension, indices, integer, vector
from athcodec.motion.quaternions import normalized, rotation_matrices
from athcodec.untyped import JsonObject

TRS = {"translation": [0.0, 0.0, 0.0], "rotation": [0.0, 0.0, 0.0, 1.0], "scale": [1.0, 1.0, 1.0]}
BONES = "ATH_bones"  # In the extras of a glTF node that athcodec wrote: what turns the bones below it.
COPIES = "copies"  # true in the extras of a node: those below show one shape, and are one object; false: or are not
POINTER, NODE_VISIBILITY = "KHR_animation_pointer", "KHR_node_visibility"
PLAYED = (*TRS, "weights", "visible")  # Properties of nodes that animations move.
_NUMBER = "(0|[1-9][0-9]{0,9})"  # An index in a JSON pointer.
POINTED = (  # What a pointer may address, each with the number of a node or a mesh.
    re.compile(rf"/nodes/{_NUMBER}/({'|'.join(TRS)})"),
    re.compile(rf"/nodes/{_NUMBER}/extensions/{NODE_VISIBILITY}/(visible)"),
    re.compile(rf"/(?:nodes|meshes)/{_NUMBER}/(weights)(?:/{_NUMBER})?"),
)
QUOTES = "'\""
INTERPOLATIONS = ("STEP", "LINEAR", "CUBICSPLINE")
RATES = (30.0, 24.0, 25.0, 60.0, 24000 / 1001, 30000 / 1001, 60000 / 1001, 12.0, 15.0, 48.0, 50.0, 100.0, 120.0)
SLOWEST, FASTEST = 10.0, 240.0  # rates of sampled motion: keys further apart are meant to be interpolated


class Target(NamedTuple):
    """What a channel animates: the property `path`, one of PLAYED, of entry number `entry` of `holder`, "nodes" or
    "meshes". Of weights it is the one with the number `weight`, or all of them if that is -1."""

    holder: str
    entry: int
    path: str
    weight: int = -1

    def __str__(self) -> str:
        return f"/{self.holder}/{self.entry}/{self.path}{f'/{self.weight}' if self.weight >= 0 else ''}"


class Channel(NamedTuple):
    """A channel that moves a node of the scene: its target's property, and the number of its sampler."""

    node: int
    target: Target
    sampler: int


def target_of(channel: JsonObject) -> Target | str:
    """Return the property that an animation channel moves. If athcodec does not play this property, return its JSON
    pointer or a readable name as text. Raises ClipError."""
    target = entry(channel, "target")
    pointed = extension(target, POINTER)
    if pointed is None:
        node, path = target.get("node"), target.get("path")
        if node is None or path not in PLAYED[:-1]:
            return f"{brief(path).strip(QUOTES)} of node {brief(node)}"
        return Target("nodes", integer(target, "node"), path)
    pointer = pointed.get("pointer")
    for pattern in POINTED:
        if isinstance(pointer, str) and (match := pattern.fullmatch(pointer)):
            index, path, *weight = match.groups()
            return Target(pointer.split("/")[1], int(index), path, int(weight[0]) if any(weight) else -1)
    return brief(pointer).strip(QUOTES)


@dataclass(frozen=True, eq=False)
class Track:
    """Values animated by the same keys: times (K,), values (K, ...), with tangents (K, 3, ...) for CUBICSPLINE."""

    times: np.ndarray
    values: np.ndarray
    interpolation: str
    is_rotation: bool

    def at(self, times: np.ndarray) -> np.ndarray:
        """Return the animated value at each of the times (k,) in seconds, (k, ...) float64, interpolated between keys
        as the file states. Before the first key and behind the last, the value stays the same."""
        after = np.searchsorted(self.times, times, "right")
        last = len(self.times) - 1
        left, right = np.clip(after - 1, 0, last), np.clip(after, 0, last)
        if self.interpolation == "STEP":
            return self.values[left].astype(np.float64)
        step = self.times[right] - self.times[left]
        fraction = np.divide(times - self.times[left], step, out=np.zeros(len(times)), where=step > 0)
        is_spline = self.interpolation == "CUBICSPLINE"
        shape = (-1,) + (1,) * (self.values.ndim - 1 - is_spline)
        fraction = np.clip(fraction, 0, 1).reshape(shape)
        if is_spline:
            return self._spline(left, right, step.reshape(shape), fraction)
        a, b = self.values[left].astype(np.float64), self.values[right].astype(np.float64)
        return slerp(a, b, fraction) if self.is_rotation else a + (b - a) * fraction

    def _spline(self, left: np.ndarray, right: np.ndarray, step: np.ndarray, t: np.ndarray) -> np.ndarray:
        a, b = self.values[left, 1].astype(np.float64), self.values[right, 1].astype(np.float64)
        out, into = step * self.values[left, 2], step * self.values[right, 0]
        t2, t3 = t * t, t * t * t
        value = (2 * t3 - 3 * t2 + 1) * a + (t3 - 2 * t2 + t) * out + (3 * t2 - 2 * t3) * b + (t3 - t2) * into
        return normalized(value) if self.is_rotation else value


def slerp(a: np.ndarray, b: np.ndarray, fraction: np.ndarray) -> np.ndarray:
    """Return the unit quaternions on the shorter arc from a to b, (..., 4) each, at `fraction` of the way: 0 gives a, 1
    gives b."""
    cosine = (a * b).sum(axis=-1, keepdims=True)
    b, cosine = np.where(cosine < 0, -b, b), np.minimum(np.abs(cosine), 1.0)
    angle = np.arccos(cosine)
    sine = np.sin(angle)
    near = sine < 1e-6
    safe = np.where(near, 1.0, sine)
    first = np.where(near, 1 - fraction, np.sin((1 - fraction) * angle) / safe)
    second = np.where(near, fraction, np.sin(fraction * angle) / safe)
    return a * first + b * second


class Scene:
    """The nodes of the default scene, and of the animations those that `play` names (None: see _together)."""

    def __init__(self, file: GltfFile, play: list[int] | None = None):
        """Read the nodes of the file's default scene and the animations with the numbers `play`. By default, play the
        animations with which players begin (`_together`)."""
        self.file = file
        self.nodes = file.items("nodes")
        self.parent = self._parents()
        self.order = self._reached()
        self._channels_of: dict[int, tuple[list[Channel], list[str]]] = {}
        self.played = self._together() if play is None else play
        self._times: dict[int, np.ndarray] = {}
        self._tracks: dict[tuple[int, str], Track] = {}
        self._weights: dict[int, list[tuple[Target, Track]]] = {}
        for index in self.played:
            self._add_animation(index)
        self._groups = self._grouped()

    def name(self, node: int) -> str:
        """Return the name of a node, "" where it has none."""
        name = self.nodes[node].get("name")
        return name if isinstance(name, str) else ""

    def says_copies(self, node: int) -> bool | None:
        """Return what a node states by COPIES about those below it: whether they are one object; None for nothing."""
        extras = self.nodes[node].get("extras") if node >= 0 else None
        stated = extras.get(COPIES) if isinstance(extras, dict) else None
        return stated if isinstance(stated, bool) else None

    # ---- structure ----

    def _parents(self) -> np.ndarray:
        """Return the number of each node's parent, -1 for a root. Raises ClipError if a node has two parents."""
        parent = np.full(len(self.nodes), -1)
        for index, node in enumerate(self.nodes):
            for child in indices(node, "children"):
                if child >= len(parent) or parent[child] >= 0 or child == index:
                    raise ClipError(f"nodes: node {index} has child {child}, expected another that has no parent yet")
                parent[child] = index
        return parent

    def _reached(self) -> list[int]:
        """Return the numbers of the nodes in the default scene, each parent before its children. If the file has no
        scene, return all its nodes. Raises ClipError if a node occurs twice."""
        scenes = self.file.items("scenes")
        if scenes:
            roots = indices(self.file.item("scenes", self.file.json.get("scene", 0)), "nodes")
        else:
            roots = np.flatnonzero(self.parent < 0).tolist()
        order, waiting, seen = [], list(reversed(roots)), set()
        while waiting:
            node = waiting.pop()
            if node >= len(self.nodes) or node in seen:
                raise ClipError(f"scenes: got node {node} twice or beyond the {len(self.nodes)} nodes, expected trees")
            seen.add(node)
            order.append(node)
            waiting.extend(reversed(indices(self.nodes[node], "children")))
        return order

    def ancestors(self, nodes: set[int]) -> list[int]:
        """Return the given nodes and all nodes above them, each parent before its children. Raises ClipError if one is
        not in the scene."""
        place = {node: i for i, node in enumerate(self.order)}
        wanted: set[int] = set()
        for node in nodes:
            if node not in place:
                raise ClipError(f"skins: got joint {node}, expected a node of the scene")
            while node >= 0 and node not in wanted:
                wanted.add(node)
                node = int(self.parent[node])
        return sorted(wanted & place.keys(), key=place.__getitem__)

    # ---- animations ----

    def _together(self) -> list[int]:
        """Return the numbers of the animations that play at once by default: the first one, and each further one that
        moves none of the nodes moved so far. A tool that writes an animation per object means them together; of several
        takes only the first plays."""
        played: list[int] = []
        moved: set[int] = set()
        for index in range(len(self.file.items("animations"))):
            targets = self.targets(index)
            if targets and not targets & moved:
                played.append(index)
                moved |= targets
        return played

    def targets(self, index: int) -> set[int]:
        """Return the nodes of the scene that an animation moves."""
        return {channel.node for channel in self._channels(index)[0]}

    def unplayed(self, index: int) -> list[str]:
        """Return what an animation addresses that moves no node of the scene, as `target_of` names it."""
        return self._channels(index)[1]

    def _channels(self, index: int) -> tuple[list[Channel], list[str]]:
        """Return (channels, others) of animation `index`: the channels that move nodes of the scene, and as text the
        targets of the channels that do not. Raises ClipError."""
        if index in self._channels_of:
            return self._channels_of[index]
        played, others, inside = [], [], set(self.order)
        for channel in entries(self.file.item("animations", index), "channels"):
            target = target_of(channel)
            if isinstance(target, str):
                others.append(target)
                continue
            count = len(self.file.items(target.holder))
            if target.entry >= count:
                raise ClipError(
                    f"animation {index}: got entry {target.entry} of {target.holder}, expected one below {count}"
                )
            moved = [target.entry] if target.holder == "nodes" else self._showing.get(target.entry, [])
            channels = [Channel(node, target, integer(channel, "sampler")) for node in moved if node in inside]
            played += channels
            if not channels:
                others.append(str(target))
        self._channels_of[index] = played, others
        return played, others

    @cached_property
    def _showing(self) -> dict[Any, list[int]]:
        """By mesh the nodes of the scene that show it with its weights and have none of their own."""
        showing: dict[Any, list[int]] = {}
        for index in self.order:
            node = self.nodes[index]
            if isinstance(node.get("mesh"), int) and node.get("weights") is None:
                showing.setdefault(node["mesh"], []).append(index)
        return showing

    def _add_animation(self, index: int) -> None:
        """Read the tracks of animation number `index` that move nodes of the scene. Raises ClipError if one is
        broken."""
        samplers = entries(self.file.item("animations", index), "samplers")
        for node, target, sampler in self._channels(index)[0]:
            if sampler >= len(samplers):
                raise ClipError(f"animation {index}: got sampler {sampler}, expected one below {len(samplers)}")
            if "matrix" in self.nodes[node] and target.path in TRS:
                raise ClipError(
                    f"animation {index}: moves node {node}, which has a matrix, expected translation, "
                    "rotation and scale"
                )
            track = self._track(samplers[sampler], target, f"animation {index}, sampler {sampler}")
            if target.path == "weights":
                self._weights.setdefault(node, []).append((target, track))
            else:
                self._tracks[node, target.path] = track
        for tracks in self._weights.values():  # A node's weights count more than its mesh's, and single ones than all.
            tracks.sort(key=lambda each: (each[0].holder == "nodes", each[0].weight >= 0))

    def _track(self, sampler: JsonObject, target: Target, where: str) -> Track:
        """Return the keys, values and interpolation of an animation sampler whose channel moves `target`. `where` names
        the sampler in messages. Raises ClipError if values and keys do not fit each other."""
        interpolation = sampler.get("interpolation", "LINEAR")
        if interpolation not in INTERPOLATIONS:
            raise ClipError(
                f"{where}: got interpolation {brief(interpolation)}, expected one of {', '.join(INTERPOLATIONS)}"
            )
        key = integer(sampler, "input")
        if key not in self._times:
            self._times[key] = self.file.floats(key)[:, 0].astype(np.float64)
        times = self._times[key]
        if not np.isfinite(times).all() or (np.diff(times) < 0).any():
            raise ClipError(f"{where}: got key times that run backward or are not finite, expected ascending seconds")
        self.file.budget.take(32 * self.file.count(integer(sampler, "output")), where)
        values = self.file.floats(integer(sampler, "output"))
        values_per_key = 3 if interpolation == "CUBICSPLINE" else 1
        path, width = target.path, values.size // (len(times) * values_per_key)
        if path != "weights" or target.weight >= 0:
            width = len(TRS.get(path, "1"))
        if width == 0 or values.size != len(times) * values_per_key * width:
            raise ClipError(
                f"{where}: got {values.size} numbers for {len(times)} keys, expected "
                f"{values_per_key * max(width, 1)} per key"
            )
        shape = (len(times), 3, width) if values_per_key == 3 else (len(times), width)
        return Track(times, values.reshape(shape), interpolation, path == "rotation")

    def _grouped(self) -> list[tuple[str, list[int], Track]]:
        """Take the transform tracks that share keys and interpolation out of `_tracks`, and return them in groups that
        are evaluated at once: (property, numbers of nodes, one track of all these nodes). Tracks of visibility stay in
        `_tracks`."""
        alike: dict[tuple[str, str, int], list[int]] = {}
        for (node, path), track in self._tracks.items():
            if path in TRS:
                alike.setdefault((path, track.interpolation, id(track.times)), []).append(node)
        groups = []
        for (path, interpolation, _), nodes in alike.items():
            tracks = [self._tracks.pop((node, path)) for node in nodes]
            values = np.stack([track.values for track in tracks], axis=-2)
            groups.append((path, nodes, Track(tracks[0].times, values, interpolation, path == "rotation")))
        return groups

    @cached_property
    def keys(self) -> np.ndarray:
        """The times of all keys, ascending, each once."""
        weights = (track for tracks in self._weights.values() for _, track in tracks)
        tracks = [*self._tracks.values(), *weights, *(track for _, _, track in self._groups)]
        tables = {id(track.times): track.times for track in tracks}
        return np.unique(np.concatenate(list(tables.values()))) if tables else np.zeros(0)

    def animates(self, nodes: set[int]) -> bool:
        """Return whether an animation that is played moves any of these nodes or one above them."""
        moved = {index for _, grouped, _ in self._groups for index in grouped}
        return not moved.isdisjoint(self.ancestors(nodes))

    def is_hidden(self, node: int) -> bool:
        """Return whether a node, or one above it, is never visible."""
        lineage = self._lineage(node)
        return any((each, "visible") not in self._tracks and not self._is_visible(each) for each in lineage)

    def shown(self, node: int, times: np.ndarray) -> np.ndarray:
        """Return (T,) whether a node and all above it are visible."""
        shown = np.ones(len(times), bool)
        for each in self._lineage(node):
            track = self._tracks.get((each, "visible"))
            shown &= self._is_visible(each) if track is None else track.at(times)[:, 0] > 0.5
        return shown

    def _lineage(self, node: int) -> Iterator[int]:
        while node >= 0:
            yield node
            node = int(self.parent[node])

    def _is_visible(self, node: int) -> bool:
        extension = (self.nodes[node].get("extensions") or {}).get(NODE_VISIBILITY)
        return not isinstance(extension, dict) or extension.get("visible") is not False

    def morphs(self, node: int) -> bool:
        """Return whether an animation that is played changes the weights of a node's mesh."""
        return node in self._weights

    # ---- evaluation ----

    def weights(self, node: int, times: np.ndarray | None, default: np.ndarray) -> np.ndarray:
        """Return the morph weights (k, targets) of a node at `times` (k,) in seconds, or those without animation (k =
        1) if times is None. `default` (targets,) has the weights that are not animated."""
        tracks = self._weights.get(node, ())
        if times is None or not tracks:
            return default[None].copy()
        weights = np.repeat(default[None], len(times), axis=0)
        for target, track in tracks:
            values = track.at(times)
            if target.weight >= len(default) or target.weight < 0 and values.shape[1] != len(default):
                got = f"weight {target.weight}" if target.weight >= 0 else f"{values.shape[1]} weights"
                raise ClipError(f"node {node}: got {got} animated, expected those of its {len(default)} morph targets")
            weights[:, slice(None) if target.weight < 0 else [target.weight]] = values
        return weights

    def matrices(self, nodes: list[int], times: np.ndarray | None) -> dict[int, np.ndarray]:
        """Return the matrices (k, 4, 4) from each node to the world at `times` (k,) in seconds, by the node's number;
        with None those without animation, k = 1. `nodes` has to come from `ancestors`, which puts parents first."""
        place = {node: i for i, node in enumerate(nodes)}
        matrices = self._locals(place, times)
        above = np.array([place.get(int(self.parent[node]), -1) for node in nodes])
        level = np.zeros(len(nodes), np.int64)
        for i in np.flatnonzero(above >= 0):  # parents stand first
            level[i] = level[above[i]] + 1
        for depth in range(1, int(level.max(initial=0)) + 1):
            places = np.flatnonzero(level == depth)
            matrices[:, places] = matrices[:, above[places]] @ matrices[:, places]
        return {node: matrices[:, i] for node, i in place.items()}

    def _locals(self, place: dict[int, int], times: np.ndarray | None) -> np.ndarray:
        """Return the matrices (k, nodes, 4, 4) from each node to its parent at `times` (k,) in seconds; with None those
        without animation, k = 1. `place` gives the column of each node number in the result."""
        frames = 1 if times is None else len(times)
        parts = {
            path: np.repeat([[vector(self.nodes[node], path, default) for node in place]], frames, axis=0)
            for path, default in TRS.items()
        }
        if times is not None:
            for path, nodes, track in self._groups:
                inside = [i for i, node in enumerate(nodes) if node in place]
                parts[path][:, [place[nodes[i]] for i in inside]] = track.at(times)[:, inside]
        matrices = np.zeros((frames, len(place), 4, 4))
        matrices[..., :3, :3] = rotation_matrices(parts["rotation"]) * parts["scale"][..., None, :]
        matrices[..., :3, 3] = parts["translation"]
        matrices[..., 3, 3] = 1.0
        for node, i in place.items():
            if "matrix" in self.nodes[node]:
                matrices[:, i] = vector(self.nodes[node], "matrix", np.eye(4).ravel().tolist()).reshape(4, 4).T
        return matrices


def key_rate(keys: np.ndarray) -> float | None:
    """Return the rate, in frames per second, of a regular grid that holds all key times `keys` (K,), in seconds; None
    if there is no such rate."""
    if len(keys) < 2:
        return None
    step = float(np.median(np.diff(keys)))
    for rate in ((1 / step if step > 0 else 0.0), *RATES):
        if SLOWEST <= rate <= FASTEST and not off_grid(keys, rate).any():
            return _exact(rate, keys)
    return None


def off_grid(keys: np.ndarray, rate: float) -> np.ndarray:
    """Return (K,) whether keys, rounded to float32 as they are, lie between frames of a rate, from the first key on."""
    places = (keys - keys[0]) * rate
    blur = 0.01 + float(np.abs(keys).max()) * 4e-7 * rate
    off: np.ndarray = (np.abs(places - np.round(places)) > blur) | (blur >= 0.3)
    return off


def _exact(rate: float, keys: np.ndarray) -> float:
    """Return the usual rate close to `rate`, in frames per second, that a tool would have stated: a whole number, a
    whole number times 1000 / 1001, or one of two decimals. If none fits the times `keys` (K,), return the rate measured
    from them."""
    span = float(keys[-1] - keys[0])
    measured = max(round(span * rate), 1) / span
    whole = round(measured)
    for likely, off in ((float(whole), 2e-4), (whole * 1000 / 1001, 2e-4), (round(measured, 2), 1e-6)):
        if abs(measured - likely) <= off * likely and not off_grid(keys, likely).any():
            return likely
    return measured
