"""Plants of L-systems (Prusinkiewicz and Lindenmayer, The Algorithmic Beauty of Plants, 1990) that grow.

A turtle walks the derived word once for each frame; a symbol is as old as the derivation steps since it appeared, and
grows, turns and thickens with its age. Every frame is a file with the same prisms and leaves, written by trimesh.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh


@dataclass(frozen=True)
class Grammar:
    """Axiom A with its successor; F a segment, L a leaf, + - turn, ^ & pitch, / rolls, [ ] a branch."""

    rules: dict[str, str]
    steps: int
    angle: float  # Degrees of + - ^ &, when the symbol is old.
    young: float  # Degrees that a symbol ^ has more when it is young: a frond unrolls.
    roll: float
    leaf: float  # Length of a leaf over that of a segment.


PLANTS = {
    "tree": Grammar({"A": "F[&FLA]/////[&FLA]///////[&FLA]"}, 5, 28.0, 0.0, 22.5, 0.7),
    "fern": Grammar({"A": "F[+P][-P]^A", "P": "F[+L][-L]P"}, 14, 52.0, 34.0, 0.0, 0.35),
    "herb": Grammar({"A": "F[&FL]/[&B]/^A", "B": "FL/B"}, 11, 40.0, 0.0, 137.5, 1.6),
}
FRAMES = 80
SQUARE = np.array([[1, 1, 0], [-1, 1, 0], [-1, -1, 0], [1, -1, 0]]) / np.sqrt(2)
BLADE = np.array([[0, 0, 0], [0.3, 0, 0.5], [0, 0.05, 1], [-0.3, 0, 0.5]])
SIDES = np.array([[0, 1, 5], [0, 5, 4], [1, 2, 6], [1, 6, 5], [2, 3, 7], [2, 7, 6], [3, 0, 4], [3, 4, 7]])


def sequence(path: Path, plant: str, seed: int, is_split: bool = False) -> None:
    """Write a growing plant as numbered mesh files whose names begin with `path`. If `is_split` is true, each triangle
    has vertices of its own, as flat shading needs.
    """
    grammar = PLANTS[plant]
    word = _derived(grammar)
    chance = np.random.default_rng(seed).normal(1, 0.12, len(word))
    faces = None
    for frame in range(FRAMES):
        points, faces = _mesh(grammar, word, chance, grammar.steps * (0.15 + 0.95 * frame / (FRAMES - 1)))
        mesh = trimesh.Trimesh(points, faces, process=False)
        if is_split:
            mesh.unmerge_vertices()
        numbered = path.with_name(path.name.replace("0000", f"{frame:04}"))
        options = {"vertex_normal": False} if path.suffix == ".ply" else {"include_normals": False, "digits": 6}
        mesh.export(numbered, **options)


def _derived(grammar: Grammar) -> list[tuple[str, int]]:
    """Return the symbols that a grammar derives, each as a pair of the symbol and the number of the derivation step in
    which it was born.
    """
    word = [("A", 0)]
    for step in range(grammar.steps):
        word = [
            new
            for symbol, born in word
            for new in ([(s, step + 1) for s in grammar.rules[symbol]] if symbol in grammar.rules else [(symbol, born)])
        ]
    return word


def _mesh(
    grammar: Grammar, word: list[tuple[str, int]], chance: np.ndarray, now: float
) -> tuple[np.ndarray, np.ndarray]:
    """Return the points (V, 3) and faces (F, 4) of a plant at the time `now`, in derivation steps. `word` has pairs of
    a symbol and its step of birth, and `chance` a random factor on each symbol's size.
    """
    place, frame, stack = np.zeros(3), np.eye(3)[[0, 2, 1]].T, []  # Columns: right, up, ahead.
    points: list[np.ndarray] = []
    faces: list[np.ndarray] = []
    count = 0
    for (symbol, born), luck in zip(word, chance.tolist()):
        age = max(now - born, 0.0)
        size = luck * (1 - np.exp(-0.6 * age * age))
        if symbol == "F":
            end = place + size * frame[:, 2]
            ring = 0.03 * size * np.sqrt(1 + age) * (SQUARE @ frame.T)
            points += [place + ring, end + 0.8 * ring]
            faces.append(SIDES + count)
            place, count = end, count + 8
        elif symbol == "L":
            points.append(place + grammar.leaf * size * (BLADE @ frame.T))
            faces.append(np.array([[0, 1, 2], [0, 2, 3]]) + count)
            count += 4
        elif symbol == "[":
            stack.append((place, frame))
        elif symbol == "]":
            place, frame = stack.pop()
        elif symbol in "+-":
            frame = frame @ _turn(0, 1 if symbol == "+" else -1, grammar.angle * luck * min(1.0, 0.4 + 0.3 * age))
        elif symbol in "^&":
            old = 4.0 if grammar.young else grammar.angle
            angle = (old if symbol == "^" else grammar.angle) * luck + grammar.young * np.exp(-0.5 * age)
            frame = frame @ _turn(1, 1 if symbol == "^" else -1, angle)
        elif symbol == "/":
            frame = frame @ _turn(2, 1, grammar.roll * luck)
    return np.concatenate(points), np.concatenate(faces)


def _turn(kind: int, sign: int, degrees: float) -> np.ndarray:
    """Return rotation about the turtle's up, right or ahead."""
    one, two = ((0, 2), (1, 2), (0, 1))[kind]
    turn, angle = np.eye(3), sign * np.radians(degrees)
    turn[one, one] = turn[two, two] = np.cos(angle)
    turn[one, two], turn[two, one] = np.sin(angle), -np.sin(angle)
    return turn
