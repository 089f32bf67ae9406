"""What a clip looks like, for formats that are drawn: the material of each face, its colour, and from which sides it is
seen.

A clip has names of materials at most: those of `face_material`, or of `surfaces`, which its texture coordinates tell
apart. The rest is guessed here, so that a plant is neither black nor invisible from behind. Words in the name of a
material or object say what kind it is, else open faces are leaves and others stems. Each kind has a colour, and open
faces are seen from both sides. Writers mark what is a guess, so that readers do not take it for a statement.
"""

from __future__ import annotations

import re
from dataclasses import dataclass

import numpy as np

from athcodec.exporters.scene_objects import SceneObject, domain_of, face_materials, is_double_sided
from athcodec.exporters.surface import Surface
from athcodec.motion.protocol import Motion

Colour = tuple[float, float, float]
LEAVES, STEMS = "leaves", "stems"
COLOURS: dict[str, Colour] = {  # Linear red, green and blue by the kind of a material.
    STEMS: (0.165, 0.125, 0.09),
    LEAVES: (0.14, 0.26, 0.05),
    "stalks": (0.15, 0.20, 0.06),
    "flowers": (0.60, 0.29, 0.38),
    "fruits": (0.42, 0.07, 0.03),
}
KINDS = list(COLOURS)
WORDS = re.compile(
    r"(?P<stems>bark|trunk|branch|bough|twig|wood|(?<!sy)stem)|"
    r"(?P<leaves>leaf|leaves|foliage|frond|pinna|blade|needle|lamina|grass)|"
    r"(?P<stalks>stalk|petiole|rachis|culm|tendril)|(?P<flowers>flower|petal|blossom)|(?P<fruits>fruit)|"
    r"(?P<plants>plant|tree|shrub|bush|seedling|sapling)",
    re.IGNORECASE,
)
"""Words of names by the kind that they mean; those of whole plants mean none."""
STEM_SURFACES, LEAF_SURFACES = ("bark", "stalks"), ("leaves", "blades", "pinnae")
"""Words of `surfaces` in the metadata, which names first that of stems, then that of leaves (docs/viewer.md)."""


@dataclass(frozen=True)
class Look:
    """A material; `guessed` names those of the other fields that the clip does not state; edges and points are not
    lit."""

    name: str
    colour: Colour
    is_two_sided: bool
    guessed: tuple[str, ...]
    is_lit: bool = True


@dataclass(frozen=True, eq=False)
class Looks:
    """Materials: those that the clip names, and behind them guessed ones. labels (F,): which of them each face has."""

    materials: list[Look]
    labels: np.ndarray
    surface: Surface


def looks_of(motion: Motion, objects: list[SceneObject]) -> Looks:
    """Return what the faces of a motion look like, which are those of its objects."""
    counts, corners = motion.polygons or (np.zeros(0, np.int64), np.zeros(0, np.int64))
    surface = Surface(counts, corners, motion.rest)
    stated = [(obj.name, obj.face_rows, is_double_sided(obj.details)) for obj in objects]
    return _looks(surface, *_named(motion), stated)


def looks_of_mesh(surface: Surface, name: str) -> Looks:
    """Return what the faces of an object look like of which only its name is known."""
    return _looks(surface, np.full(len(surface.is_open), -1), [], [(name, slice(None), False)])


def _looks(surface: Surface, labels: np.ndarray, names: list[str], objects: list[tuple[str, slice, bool]]) -> Looks:
    """Return the materials with their colours. `labels` (F,) has the number in `names` of each face's material, -1 for
    none. `objects` has the name of each object, its faces, and whether it states that its faces are seen from both
    sides.
    """
    kinds = np.where(surface.is_open, KINDS.index(LEAVES), KINDS.index(STEMS))
    states_sides = np.zeros(len(labels), bool)
    for object_name, rows, is_stated in objects:
        states_sides[rows] = is_stated
        if of_object := kind_of(object_name):
            kinds[rows] = KINDS.index(of_object)
    # Faces without a material get one for each kind, another where both sides are stated.
    is_nameless = labels < 0
    used, place = np.unique((2 * kinds + states_sides)[is_nameless], return_inverse=True)
    labels[is_nameless] = len(names) + place.ravel()
    every: list[tuple[str, str, tuple[str, ...]]] = [
        (name, kind_of(name) or _commonest(kinds[labels == i]), ()) for i, name in enumerate(names)
    ]
    every += [(KINDS[code // 2], KINDS[code // 2], ("name",)) for code in used.tolist()]
    materials = []
    for i, (name, kind, guessed) in enumerate(every):
        is_open, is_stated = (bool(each[labels == i].any()) for each in (surface.is_open, states_sides))
        guessed += ("colour", "is_two_sided") if is_open and not is_stated else ("colour",)
        materials.append(Look(name, COLOURS[kind], is_open or is_stated, guessed))
    return Looks(materials, labels, surface)


def line_look(name: str) -> Look:
    """Return the look of an object of edges or points, of which nothing but its name says anything."""
    kind = kind_of(name) or STEMS
    return Look(kind, COLOURS[kind], False, ("name", "colour"), is_lit=False)


def kind_of(name: str) -> str | None:
    """Return the kind that a name means by its last telling word, which is the noun: "flower_stalk", "leafy_tree"."""
    words = [str(match.lastgroup) for match in WORDS.finditer(name)]
    return words[-1] if words and words[-1] in COLOURS else None


def _commonest(kinds: np.ndarray) -> str:
    return KINDS[np.bincount(kinds, minlength=1).argmax()]


def _named(motion: Motion) -> tuple[np.ndarray, list[str]]:
    """Return (F,) the material of each face among the names of the clip's materials, -1 for none; and these names."""
    count = 0 if motion.polygons is None else len(motion.polygons[0])
    labels, names = face_materials(motion) or _surfaces(motion) or (np.full(count, -1), [])
    return np.where(labels < len(names), np.maximum(labels, -1), -1), names


def _surfaces(motion: Motion) -> tuple[np.ndarray, list[str]] | None:
    """Return a label (F,) for each face and the names of the labels, if texture coordinates tell stems and leaves
    apart: those of leaves have a first number above 1. Return None if they do not.
    """
    stated, uv = motion.metadata.get("surfaces"), motion.attributes.get("uv")
    names = stated.split(", ") if isinstance(stated, str) else []
    is_known = len(names) == 2 and names[0] in STEM_SURFACES and names[1] in LEAF_SURFACES
    if not is_known or motion.polygons is None or uv is None or uv.ndim != 2 or uv.dtype.kind != "f":
        return None
    counts, corners = motion.polygons
    domain = domain_of(motion, "uv", uv, motion.metadata.get("domains", {}))
    if domain not in ("vertex", "corner"):
        return None
    across = uv[corners, 0] if domain == "vertex" else uv[:, 0]
    sums = np.bincount(np.repeat(np.arange(len(counts)), counts), across, len(counts))
    used, labels = np.unique((sums > counts).astype(np.int64), return_inverse=True)
    return labels.ravel(), [names[number] for number in used]
