"""Reads the branches of a plant from an MTG, the multiscale tree graph of OpenAlea and AMAPmod (text, FORM-A).

A branch is a longest chain of `<`; `+` begins one. Where entities are decomposed (`/`) their finest parts count: those
that have no parts themselves. Parts that the file does not connect follow one another in its order. Codes may be
absolute, shifted to the right, begin with ^ or an alias, and use <<, ++, <.< and +.+; entities without a number are new
ones, as OpenAlea reads them. Features are kept as numbers where they are numbers. Not read: FORM-B, what the header
says of constraints, and rows of later dates (`*`).

A clip gets these branches by the coordinates XX, YY, ZZ (or X, Y, Z), in the clip's own units and axes, or vertex by
vertex where there are as many. A SourceWarning names the features that have no place in a clip, and rows of later
dates.
"""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from os import fspath
from typing import Any

import numpy as np

from athcodec.errors import ClipError, SourceWarning
from athcodec.files.plain import FilePath, open_plain
from athcodec.motion.clip import MotionClip

MAX_FILE_BYTES = 1 << 28
MAX_ENTITIES = 1 << 22
FARTHEST = 0.1  # Largest median distance of the clip's vertices from the plant of the MTG, over the clip's diagonal.
COORDINATES = (("XX", "YY", "ZZ"), ("X", "Y", "Z"))  # Names, in upper case, of the features that are a position.
ALIAS = "Alias"
BLOCK_PAIRS = 1 << 20
_SECTION = re.compile(r"\s*(CODE|CLASSES|DESCRIPTION|FEATURES|MTG)\s*:?\s*(\S*)")
_BEGINNINGS = ("/", "<", "+", "^", "(")
_STEP = re.compile(r"(<\.<|\+\.\+|<<|\+\+|[/<+])([A-Za-z_$][A-Za-z_]*)(\d{0,9})")


@dataclass(frozen=True, eq=False)
class Mtg:
    """The finest parts of the plants of an MTG, V of them in the order of the file, on B branches.

    labels         (V,) such as "E12"
    parent         (V,) int32, the part below, -1 for a root
    branch         (V,) int32, and branch_parent (B,) int32, -1 for a root
    positions      (V, 3) float64 from XX, YY, ZZ; NaN where a part has none
    base           (V, 3) where the part begins: the position of the part below, or what the file says of the entity
                   that it is the first part of; NaN where neither is known
    features       name: (V,) float64, NaN where there is no number
    later_rows     how many rows there are of later dates, which are not read
    """

    labels: Sequence[str]
    parent: np.ndarray
    branch: np.ndarray
    branch_parent: np.ndarray
    positions: np.ndarray
    base: np.ndarray
    features: dict[str, np.ndarray]
    later_rows: int = 0

    @property
    def edges(self) -> np.ndarray:
        """(E, 2) int32: part below and part."""
        above = np.flatnonzero(self.parent >= 0)
        return np.stack([self.parent[above], above], axis=1).astype(np.int32)


def read_mtg(path: FilePath) -> Mtg:
    """Return the plants in an MTG (multiscale tree graph) file. Raises ClipError that names the line at fault, OSError
    if the file cannot be opened."""
    if os.path.getsize(path) > MAX_FILE_BYTES:
        raise ClipError(f"{fspath(path)}: got {os.path.getsize(path)} bytes, expected at most {MAX_FILE_BYTES}")
    with open_plain(path) as file:
        text = file.read().decode("utf-8", "replace")
    try:
        return _parts(_Plants(text))
    except (ClipError, RecursionError, OverflowError) as error:
        raise ClipError(f"{fspath(path)}: {error}") from None


def mtg_branches(path: FilePath, clip: MotionClip) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return (vertex_branch (N,), branch_parent (B,), stem_index (N,)), int32, of a clip's vertices on the branches of
    the plant in the MTG file `path`: the branch of each vertex, the parent of each branch, -1 for a root, and the
    vertex's place along its branch.

    If at least half of the MTG's parts have coordinates, each vertex belongs to the nearest part of the plant at rest.
    Otherwise vertices are the parts in their order, and there have to be as many. Branches without vertices are left
    out. Raises ClipError if neither is possible, or if the plant of the MTG lies elsewhere than the clip.
    """
    mtg = read_mtg(path)
    _name_others(path, mtg)
    located = np.isfinite(mtg.positions).all(axis=1)
    if 2 * located.sum() >= len(located) or (located.any() and len(located) != clip.vertex_count):
        branch, along = _nearest(path, mtg, located, np.asarray(clip.rest, np.float64))
    elif len(mtg.labels) == clip.vertex_count:
        branch, along = mtg.branch, _depths(mtg.parent)
    else:
        raise ClipError(
            f"{fspath(path)}: got {len(mtg.labels)} parts without coordinates, expected "
            f"{clip.vertex_count} as vertices of the clip, or the features XX, YY and ZZ; it has "
            f"{', '.join(mtg.features) or 'none'}"
        )
    branch, branch_parent = _without_empty(branch, mtg.branch_parent)
    order = np.lexsort((np.arange(len(branch)), along, branch))
    labels = branch[order]
    stem_index = np.empty(len(branch), np.int32)
    stem_index[order] = np.arange(len(order)) - np.searchsorted(labels, labels)
    return branch, branch_parent, stem_index


def _name_others(path: FilePath, mtg: Mtg) -> None:
    """Give a SourceWarning that names what the MTG file holds and branches have no place for: features, and rows of
    later dates."""
    features = [name for name in mtg.features if name not in (*_coordinates(list(mtg.features)), ALIAS)]
    others = [f"features {', '.join(features)}"] if features else []
    others += [f"{mtg.later_rows} row{'s' * (mtg.later_rows != 1)} of later dates (*)"] if mtg.later_rows else []
    if others:
        warnings.warn(
            f"{fspath(path)}: read for its branches alone; not read: {'; '.join(others)}", SourceWarning, stacklevel=3
        )


# ---- the text ----


@dataclass
class _Entity:
    label: str
    scale: int
    whole: int  # the entity that this is a part of; -1 for none
    relation: str
    origin: int  # the entity that the code came from
    parts: list[int] = field(default_factory=list)
    features: dict[str, str] = field(default_factory=dict)


class _Plants:
    """All entities of a file at all scales."""

    def __init__(self, text: str):
        """Read the entities in the text of an MTG file. Raises ClipError if the text is none."""
        self.entities: list[_Entity] = []
        self.names: list[str] = []
        self._scales: dict[str, int] = {}
        self._known: dict[tuple[int, str, str], int] = {}  # (from, relation, label) of an entity
        self._aliases: dict[str, int] = {}
        self._latest: list[int] = []  # by column
        self._topology_columns = 0
        self._line = 0
        self.later_rows = 0
        closed = text.rfind("#)") + 2  # Behind it no comment ends, and none is looked for.
        text = re.sub(r"\(#.*?#\)", _only_breaks, text[:closed], flags=re.DOTALL) + text[closed:]
        lines = [line.partition("#")[0] for line in text.splitlines()]
        rows = self._header(lines)
        for self._line, cells in rows:
            self._row(cells)
        if not self.entities:
            raise ClipError("got no entities, expected a code behind MTG:")

    def _fail(self, problem: str) -> ClipError:
        return ClipError(f"line {self._line}: {problem}")

    def _header(self, lines: Sequence[str]) -> Iterator[tuple[int, list[str]]]:
        """Read the sections before "MTG:" and return the rows behind it, each as the number of its line and its cells.
        `lines` are the lines of the file without comments."""
        section, form = "", ""
        for number, line in enumerate(lines):
            self._line = number + 1
            cells = [cell.strip() for cell in line.split("\t")]
            if not any(cells):
                continue
            match = _SECTION.match(" ".join(cells))
            if match and (section != "CLASSES" or ":" in line or cells[0].rstrip(": ") in ("DESCRIPTION", "FEATURES")):
                section = match[1]
                form = match[2] if section == "CODE" else form
                if section == "MTG":
                    break
            elif section == "CLASSES":
                self._class(" ".join(cells).split())
        else:
            raise ClipError("got no section MTG:, expected an MTG file")
        if form != "FORM-A":
            raise ClipError(f"CODE: got {form[:20]!r}, expected FORM-A")
        return self._columns(lines, number + 1)

    def _class(self, words: Sequence[str]) -> None:
        if len(words) >= 2 and words[1].isdigit():
            self._scales[words[0]] = int(words[1])

    def _columns(self, lines: Sequence[str], start: int) -> Iterator[tuple[int, list[str]]]:
        """Read the row with the names of the columns, which is the first with text from line `start` on. Return the
        rows behind it, each as the number of its line and its cells."""
        rows = ((number + 1, line.split("\t")) for number, line in enumerate(lines[start:], start))
        for self._line, cells in rows:
            names = [cell.strip() for cell in cells]
            if any(names):
                break
        else:
            raise ClipError("got no row TOPO, expected the names of the columns")
        if names[0] not in ("TOPO", "ENTITY-CODE"):
            raise self._fail(f"got {names[0][:20]!r}, expected TOPO and the names of features")
        named = [column for column, name in enumerate(names[1:], 1) if name]
        self._topology_columns = named[0] if named else MAX_ENTITIES
        self.names = names
        return rows

    def _row(self, cells: Sequence[str]) -> None:
        """Read a row: make the entities that its code describes and store the row's features in them. Rows of later
        dates ("*") are only counted."""
        cells = [cell.strip() for cell in cells]
        column = next((place for place, cell in enumerate(cells[: self._topology_columns]) if cell), None)
        if column is None or cells[column] == "*":
            self.later_rows += column is not None
            return
        features = {
            self.names[place]: cells[place]
            for place in range(self._topology_columns, len(cells))
            if place < len(self.names) and self.names[place] and cells[place]
        }
        code = re.sub(r"\s", "", cells[column])
        extra = next((cell for cell in cells[column + 1 : self._topology_columns] if cell.startswith(_BEGINNINGS)), "")
        if extra:
            raise self._fail(f"got the codes {code[:20]!r} and {extra[:20]!r}, expected one")
        made = self._code(code, column)
        for entity in made:
            self.entities[entity].features |= features
        if ALIAS in features:
            self._aliases[features[ALIAS]] = self._latest[column]

    def _code(self, code: str, column: int) -> list[int]:
        """Make the entities that the code of a row describes, such as "/P1/A1<U2", and return the numbers of those that
        the row's features belong to. `column` is the column in which the code stands."""
        start, code, is_absolute = self._start(code, column)
        at, now, about = 0, start, []
        for step in _STEP.finditer(code):
            if step.start() != at:
                break
            at = step.end()
            before = now
            made = [
                now := self._step(now, relation, label, is_absolute)
                for relation, label in self._unfolded(now, *step.groups())
            ]
            about = made if "." in step[1] else [now]
            if "." in step[1] and before >= 0:
                about = [before, *made]
        if at != len(code) or not about:
            raise self._fail(f"got the code {code[at:][:30]!r}, expected /, < or + and a label such as U1")
        del self._latest[column:]
        self._latest += [-1] * (column - len(self._latest)) + [now]
        return about

    def _start(self, code: str, column: int) -> tuple[int, str, bool]:
        """Return (entity, code, is_absolute): the number of the entity on which the code in `column` goes on, -1 at the
        beginning; the code without the prefix that named this entity; and whether labels in it may refer to entities
        that exist already."""
        if code.startswith("^"):
            if column >= len(self._latest) or self._latest[column] < 0:
                raise self._fail("got ^ in a column without a code above")
            return self._latest[column], code[1:], False
        alias = re.match(r"\(([^)]*)\)", code)
        if alias:
            if alias[1] not in self._aliases:
                raise self._fail(f"got the alias {alias[1][:20]!r}, which no entity above has")
            return self._aliases[alias[1]], code[alias.end() :], True
        left = next((entity for entity in reversed(self._latest[:column]) if entity >= 0), -1)
        above = self._latest[column] if column < len(self._latest) else -1
        first = _STEP.match(code)
        if above >= 0 and first:  # A row goes on from the one above it where it can be no part of what is to its left.
            scale = self._scales.get(first[2], 1)
            is_part = left >= 0 and first[1] == "/" and self.entities[left].scale >= scale > self.entities[above].scale
            if is_part or (left < 0 and scale > 1):
                return above, code, False
        return left, code, left < 0

    def _unfolded(self, now: int, relation: str, symbol: str, index: str) -> Iterator[tuple[str, str]]:
        """Yield (relation, label) for each step that one step of a code stands for: behind E1, "<<E4" stands for <E2,
        <E3 and <E4. `now` is the number of the entity before it; `symbol` and `index` are the letters and digits of the
        label."""
        if len(relation) == 1:
            yield relation, symbol + index
            return
        before = re.fullmatch(r"(\D+)(\d+)", self.entities[now].label) if now >= 0 else None
        if before is None or before[1] != symbol or not index or not int(before[2]) < int(index):
            raise self._fail(f"got {relation}{symbol}{index}, expected it behind a lower number of {symbol}")
        if int(index) - int(before[2]) + len(self.entities) > MAX_ENTITIES:
            raise self._fail(f"got more than {MAX_ENTITIES} entities")
        for number in range(int(before[2]) + 1, int(index) + 1):
            yield relation[0], f"{symbol}{number}"

    def _step(self, now: int, relation: str, label: str, is_absolute: bool) -> int:
        """Return the number of the entity that `relation` ("/", "<" or "+") and `label` lead to from the entity `now`.
        It is made if it does not exist yet. `is_absolute` says that a known label always means the known entity."""
        known = self._known.get((now, relation, label)) if label[-1].isdigit() else None
        if known is not None and (is_absolute or relation != "+"):
            return known
        symbol = label.rstrip("0123456789")
        if symbol not in self._scales:
            raise self._fail(f"got the class {symbol[:20]!r}, expected one of {', '.join(self._scales)[:80]}")
        if len(self.entities) >= MAX_ENTITIES:
            raise self._fail(f"got more than {MAX_ENTITIES} entities")
        scale = self._scales[symbol]
        origin = now if relation == "/" else self._bearer(now, scale)
        beside = self._at_scale(origin, scale)
        if relation == "/":
            whole = self._at_scale(now, scale - 1)
        else:
            if now < 0:
                raise self._fail(f"got {relation}{label[:20]} at the beginning, expected /")
            whole = self.entities[beside].whole if beside >= 0 else -1
        entity = len(self.entities)
        self.entities.append(_Entity(label, scale, whole, relation, origin))
        if whole >= 0:
            self.entities[whole].parts.append(entity)
        self._known[now, relation, label] = entity
        return entity

    def _bearer(self, entity: int, scale: int) -> int:
        """Return the number of the entity that a following "<" or "+" connects to, if the code so far ended at `entity`
        and the new one has scale `scale`. Behind S3+B2, "<S4" connects to S3, and so does "+B3" once B2 has parts in
        columns of its own."""
        at = entity
        while at >= 0:
            now = self.entities[at]
            is_borne = now.relation != "/"
            is_left = is_borne and now.parts and self.entities[now.origin].scale > now.scale
            if now.scale >= scale and not is_left:
                return at
            at = now.origin if is_borne else -1
        return entity

    def _at_scale(self, entity: int, scale: int) -> int:
        """Return the entity itself or the one that it is a part of, at this scale or the next coarser."""
        while entity >= 0 and self.entities[entity].scale > scale:
            entity = self.entities[entity].whole
        return entity


def _only_breaks(match: re.Match[str]) -> str:
    return "\n" * match[0].count("\n")


# ---- the finest parts ----


def _parts(plants: _Plants) -> Mtg:
    """Return the entities without parts, the finest of the plants, with their parents, branches, positions and
    features."""
    entities = plants.entities
    leaves = [number for number, entity in enumerate(entities) if not entity.parts]
    place = {number: row for row, number in enumerate(leaves)}
    parent, follows = np.full(len(leaves), -1, np.int32), np.zeros(len(leaves), bool)
    for row, leaf in enumerate(leaves):
        below, relation = _below(entities, leaf)
        if below >= 0:
            parent[row], follows[row] = place[_last_leaf(entities, below)], relation == "<"
    order = _roots_first(parent)
    branch, branch_parent = _chains(parent, follows, order)
    features = {
        name: np.array([_number(entities[leaf].features.get(name)) for leaf in leaves])
        for name in plants.names[1:]
        if name
    }
    coordinates = _coordinates(plants.names)
    positions = np.array([_position(entities[leaf], coordinates) for leaf in leaves])
    base = positions[parent]
    base[parent < 0] = np.nan
    for row in order:
        if parent[row] >= 0 and not np.isfinite(base[row]).all():
            base[row] = base[parent[row]]
        stated = _stated_base(entities, leaves[row], coordinates)
        if stated is not None:
            base[row] = stated
    labels = [entities[leaf].label for leaf in leaves]
    return Mtg(labels, parent, branch, branch_parent, positions, base, features, plants.later_rows)


def _below(entities: Sequence[_Entity], leaf: int) -> tuple[int, str]:
    """Return (entity, relation): the entity that the finest part `leaf` is connected to, -1 for none, and whether it
    follows ("<") or branches off ("+"). The first part of a whole is connected as the whole is; each further part
    without a relation follows the part before it."""
    entity = leaf
    while entities[entity].relation == "/":
        whole = entities[entity].whole
        if whole < 0:
            return -1, ""
        siblings = entities[whole].parts
        if siblings[0] != entity:
            return siblings[_place(siblings, entity) - 1], "<"
        entity = whole
    return entities[entity].origin, entities[entity].relation


def _place(numbers: Sequence[int], number: int) -> int:
    low, high = 0, len(numbers)
    while low < high:
        middle = (low + high) // 2
        low, high = (middle + 1, high) if numbers[middle] < number else (low, middle)
    return low


def _last_leaf(entities: Sequence[_Entity], entity: int) -> int:
    while entities[entity].parts:
        entity = entities[entity].parts[-1]
    return entity


def _roots_first(parent: np.ndarray) -> list[int]:
    """Return the numbers of all parts, each after its parent (`parent` (V,), -1 for a root). Raises ClipError if the
    parts form a cycle."""
    children: list[list[int]] = [[] for _ in parent]
    for row, below in enumerate(parent.tolist()):
        if below >= 0:
            children[below].append(row)
    order = np.flatnonzero(parent < 0).tolist()
    for row in order:
        order += children[row]
    if len(order) < len(parent):
        raise ClipError(f"got {len(parent) - len(order)} parts that hang on one another in a circle, expected a tree")
    return order


def _chains(parent: np.ndarray, follows: np.ndarray, order: Sequence[int]) -> tuple[np.ndarray, np.ndarray]:
    """Return the branch of each part (V,) and the parent of each branch (B,), -1 for none. A part continues its
    parent's branch if `follows` is set for it and no part before it in the file did; else it begins a branch. `order`
    lists parents before children."""
    begins, continued = np.ones(len(parent), bool), set()
    for row in range(len(parent)):
        if follows[row] and int(parent[row]) not in continued:
            continued.add(int(parent[row]))
            begins[row] = False
    number = np.cumsum(begins) - 1
    branch, branch_parent = np.zeros(len(parent), np.int32), np.full(int(begins.sum()), -1, np.int32)
    for row in order:
        below = parent[row]
        branch[row] = number[row] if begins[row] else branch[below]
        if begins[row] and below >= 0:
            branch_parent[number[row]] = branch[below]
    return branch, branch_parent


def _number(text: Any) -> float:
    try:
        return float(text)
    except (TypeError, ValueError):
        return np.nan


def _coordinates(names: Sequence[str]) -> tuple[str, ...]:
    """Return the names of the features that are a position; none where a file has no such features."""
    by_upper = {name.upper(): name for name in names}
    return next((tuple(by_upper[name] for name in axes) for axes in COORDINATES if by_upper.keys() >= set(axes)), ())


def _position(entity: _Entity, coordinates: Sequence[str]) -> list[float]:
    return [_number(entity.features.get(name)) for name in coordinates] or [np.nan] * 3


def _stated_base(entities: Sequence[_Entity], leaf: int, coordinates: Sequence[str]) -> list[float] | None:
    """Return the position that the file states for an entity whose first finest part is `leaf`, which is where this
    part begins; None if it states none. `coordinates` are the names of the columns of x, y and z."""
    entity = leaf
    while entities[entity].whole >= 0 and entities[entities[entity].whole].parts[0] == entity:
        entity = entities[entity].whole
        position = _position(entities[entity], coordinates)
        if np.isfinite(position).all():
            return position
    return None


# ---- on a clip ----


def _depths(parent: np.ndarray) -> np.ndarray:
    """Return (V,) how many parts lie between each part and its root."""
    depth = np.zeros(len(parent))
    for row in _roots_first(parent):
        if parent[row] >= 0:
            depth[row] = depth[parent[row]] + 1
    return depth


def _nearest(path: FilePath, mtg: Mtg, located: np.ndarray, rest: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return for each vertex of `rest` (N, 3) the branch of the nearest part (N,), and how far along the branch the
    nearest point is (N,), in parts. `located` (V,) marks the parts whose position is known. Raises ClipError if the
    plant lies elsewhere than the vertices."""
    rows = np.flatnonzero(located)
    tip = mtg.positions[rows]
    base = np.where(np.isfinite(mtg.base[rows]).all(axis=1, keepdims=True), mtg.base[rows], tip)
    piece, share, distance = _nearest_pieces(rest, base, tip)
    diagonal = np.linalg.norm(np.ptp(rest, axis=0))
    if np.median(distance) > FARTHEST * diagonal:
        raise ClipError(
            f"{fspath(path)}: half of the vertices are more than {np.median(distance):.3g} away from the "
            f"plant of the MTG, expected {FARTHEST * diagonal:.3g}: are its units and axes the clip's?"
        )
    return mtg.branch[rows[piece]], _depths(mtg.parent)[rows[piece]] + share


def _nearest_pieces(points: np.ndarray, base: np.ndarray, tip: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return for each of `points` (N, 3) the number of the nearest straight piece, where on the piece its nearest point
    is, from 0 at the base to 1 at the tip, and the distance; (N,) each. `base` and `tip` (P, 3) are the ends of the
    pieces."""
    along = tip - base
    square = np.maximum((along**2).sum(axis=1), 1e-300)
    piece, share = np.zeros(len(points), np.int64), np.zeros(len(points))
    distance = np.zeros(len(points))
    rows = max(1, BLOCK_PAIRS // len(base))
    for start in range(0, len(points), rows):
        block = points[start : start + rows]
        from_base = block[:, None] - base
        shares = np.clip(np.einsum("ijk,jk->ij", from_base, along) / square, 0, 1)
        away = ((from_base - shares[..., None] * along) ** 2).sum(axis=2)
        best = away.argmin(axis=1)
        every = np.arange(len(block))
        piece[start : start + rows], share[start : start + rows] = best, shares[every, best]
        distance[start : start + rows] = np.sqrt(away[every, best])
    return piece, share, distance


def _without_empty(branch: np.ndarray, branch_parent: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return (branch, branch_parent) without the branches that have no vertices. Children of a removed branch get its
    nearest ancestor that has vertices as parent, -1 if there is none. `branch` (N,) is the branch of each vertex."""
    used = np.bincount(branch, minlength=len(branch_parent)) > 0
    parent = branch_parent.astype(np.int64)
    while True:
        skipped = (parent >= 0) & ~used[parent]
        if not skipped.any():
            break
        parent[skipped] = parent[parent[skipped]]
    number = np.cumsum(used) - 1
    kept = parent[used]
    return number[branch].astype(np.int32), np.where(kept < 0, -1, number[kept]).astype(np.int32)
