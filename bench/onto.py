"""A mesh that moves by the file of a plant's skeleton: bytes and errors beside those of the mesh's own file.

The canopies hang on the beams that were simulated, the Blender tree on the bones of its armature, a scan of a small
tree on beams too; and a canopy's coarse mesh on its fine one, a plant whose stems are surfaces. The skeleton is
stored with its exact rest pose, on which the mesh lies. Errors are those of the mesh's vertices against their own
motion; wood and leaves stand apart, because leaves in the wind flutter on hinges that no skeleton has.
"""

from __future__ import annotations

import argparse
import tempfile
from contextlib import closing
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

import athcodec
from athcodec.binding.surface import MeshPoints
from athcodec.files.gltf.document import GltfFile
from athcodec.metrics import ErrorMeter
from athcodec.metrics.shape import edges_of
from athcodec.sources.gltf_scene import Scene
from bench import data
from bench.clips import REL_ERROR, add_rel_error
from bench.tables import ROOT, table
from bench.trees.leaves import SPECIES, Leaves
from bench.trees.mesh import Tubes
from bench.trees.ride import Skeleton
from bench.trees.scan import scanned, thickened

CANOPIES = ("canopy_15k_200f", "canopy_67k_200f")
ARMATURE = "blender_armature_tree"
SCAN, SCANNED = "scan", data.Canopy(40, 1, 40, 2.0, 8.0, 0, "broadleaf", seed=5)
THICKER = 4.0  # Girth of the stems of the scanned tree, over those of the simulation, so that a grid resolves twigs.
CELL = 0.016  # Metres: the width of a cell of the scan's skin.
NOISE = 0.0003  # Metres: the standard deviation of the scan's points.
ON_MESH, SURFACE, COARSE_SIDES = "canopy_4k_on_its_mesh", "canopy_4k_60f", 4
OTHERS = f"{ARMATURE}, {SCAN}, {ON_MESH}"
TAIL = 0.999  # Quantile of edges whose stretch is stated.
MOST_STRETCH = 0.02  # Stretch of edges at that quantile.
JOINT = 1.0  # Distance of points of two pieces at a joint in the rest pose, in lengths of a median edge.
OPEN = 1e-3  # Widest opening of a joint, over the plant's diagonal, less that in the mesh's own motion.
PICTURE = ROOT / "bench" / "results" / "onto.svg"
DRAWN = "canopy_1k_60f"
LODS = (("LOD 0", 6, 120), ("LOD 1", 4, 60), ("LOD 2", 3, 20))  # Sides of tubes, and leaves.
WIDTH, HEIGHT, MARGIN, CAPTION = 210, 430, 12, 44  # Of a panel, in pixels.
WOOD, LEAF, FADED = np.array([112, 84, 58]), np.array([96, 148, 66]), "#c9cfd6"
LIGHT = np.array([-0.4, 0.7, 0.6]) / np.linalg.norm([-0.4, 0.7, 0.6])
NOTE = """
Bytes of the skeleton's file and of the mesh's own file, both within the bound of their diagonals, the mesh without
other attributes than faces. Errors in metres against the mesh's own motion, of wood and of leaves; size: the diagonal
of the mesh. Stretch: |length / length at rest - 1| of edges at 99.9 %, as the mesh moves with the skeleton, in its own
motion, and of the skeleton's own edges. Gap: by how much a stem and one that grows on it come apart at most where they
touch at rest, in both. Bones of the mesh that --bind writes, and how far its skin is off the moved mesh at most.
Seconds: to bind the mesh, and to move a frame.
"""


@dataclass(frozen=True)
class Case:
    """A mesh with its own motion, and the skeleton that it was made on."""

    name: str
    skeleton: athcodec.MotionClip
    mesh: athcodec.MotionClip
    is_wood: np.ndarray


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Add the arguments of `bench onto` to a parser: names of cases, the error bound, and the path of a picture to draw
    instead.
    """
    parser.add_argument(
        "clips",
        nargs="*",
        default=(*CANOPIES, ARMATURE, SCAN, ON_MESH),
        metavar="CLIP",
        help="names of canopies, or " + OTHERS,
    )
    add_rel_error(parser)
    parser.add_argument(
        "--picture",
        type=Path,
        metavar="FILE.svg",
        help=f"only draw a skeleton and three meshes that it moves, as {PICTURE.relative_to(ROOT)} shows them",
    )


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Bind each mesh to the decoded skeleton of its plant and compare it with its own motion. Return the table, and
    lines about meshes whose edges stretch or joints open too far; or only draw the picture that was asked for.
    """
    if args.picture:
        args.picture.write_text(drawn(), "utf-8")
        return {
            "tables": [table("Picture", [{"file": args.picture.name, "bytes": args.picture.stat().st_size}])],
            "broken": [],
        }
    rows, broken = [], []
    for name in args.clips:
        row = measured(case_of(name), args.rel_error)
        rows.append(row)
        if row["stretch"] > MOST_STRETCH + row["own stretch"]:
            broken.append(f"{name}: edges stretch by {row['stretch']:g}, their own by {row['own stretch']:g}")
        if row["gap"] is not None and row["gap"] > row["own gap"] + OPEN * row["size"]:
            broken.append(f"{name}: joints open by {row['gap']:g}, their own by {row['own gap']:g}")
    return {"tables": [table(f"Onto, bound {args.rel_error:g}", rows, NOTE)], "broken": broken}


def case_of(name: str) -> Case:
    """Return the case of a name: a skeleton, the mesh that it is to move, and which vertices of the mesh are wood.
    Raise KeyError for a name that is neither a canopy nor one of OTHERS.
    """
    if name == SCAN:
        beams = thickened(SCANNED.skeleton(), THICKER)
        scan = scanned(beams, CELL, NOISE, SCANNED.seed)
        return Case(name, beams, scan, np.ones(scan.vertex_count, bool))
    if name == ON_MESH:
        canopy = data.RECIPES[SURFACE]
        assert isinstance(canopy, data.Canopy)
        fine, coarse = athcodec.read(data.path_of(SURFACE)), canopy.with_sides(COARSE_SIDES)
        return Case(name, fine, coarse, coarse.vertex_branch < fine.branch_count - canopy.leaves)
    if name == ARMATURE:
        path = data.path_of(name)
        mesh = athcodec.read(path)
        pieces = MeshPoints(mesh.rest, mesh.polygons, None)
        size = np.bincount(pieces.piece, minlength=pieces.piece_count)
        return Case(name, bones(path, mesh), mesh, size[pieces.piece[pieces.of_vertex]] > 4)
    recipe = data.RECIPES[name]
    if not isinstance(recipe, data.Canopy):
        raise KeyError(f"clip: got {name!r}, expected a canopy or {OTHERS}")
    beams = recipe.skeleton()
    mesh = athcodec.read(data.path_of(name))
    return Case(name, beams, mesh, mesh.vertex_branch < beams.branch_count)


def bones(path: Path, mesh: athcodec.MotionClip) -> athcodec.MotionClip:
    """Return the joints of a GLB's skin as a clip of centre lines, with the tips of the last bones, at the times of the
    mesh.
    """
    with closing(GltfFile(path)) as file:
        scene = Scene(file)
        joints = {joint for skin in file.items("skins") for joint in skin["joints"]}
        order = [node for node in scene.ancestors(joints) if node in joints]
        times = mesh.time + mesh.metadata["start_frame"] / mesh.metadata["fps"]
        moved, still = (scene.matrices(scene.ancestors(joints), when) for when in (times, None))
    number = {node: row for row, node in enumerate(order)}
    parent = np.array([number.get(int(scene.parent[node]), -1) for node in order])
    last = np.setdiff1d(np.arange(len(order)), parent)
    heads = np.stack([still[node][0, :3, 3] for node in order])
    # A bone lies along y; glTF does not have its length: that of the one before it stands for it.
    length = np.linalg.norm(heads[last] - heads[parent[last]], axis=1)

    def nodes(matrices: dict[int, np.ndarray]) -> np.ndarray:
        frames = np.stack([matrices[node] for node in order], axis=1)
        ends = frames[:, last]
        tips = ends[..., :3, 3] + length[:, None] * ends[..., :3, 1]
        return np.concatenate([frames[..., :3, 3], tips], axis=1)

    links = [(parent[row], row) for row in range(len(order)) if parent[row] >= 0]
    links += [(row, len(order) + number) for number, row in enumerate(last.tolist())]
    return athcodec.MotionClip(
        nodes(moved).astype(np.float32),
        mesh.time,
        rest=nodes(still)[0].astype(np.float32),
        edges=np.array(links),
        metadata={"unit": "m", "up_axis": "y", "fps": mesh.fps},
    )


def measured(case: Case, rel_error: float) -> dict[str, Any]:
    """Return the table's row of a case: the bytes of the skeleton's file and of the mesh's own, the distance of the
    mesh that the skeleton moves from the mesh's own motion, and how much its edges stretch.
    """
    from time import perf_counter

    with tempfile.TemporaryDirectory() as folder:
        skeleton, direct = Path(folder, "skeleton.ath"), Path(folder, "mesh.ath")
        athcodec.encode(case.skeleton, skeleton, rel_error=rel_error, exact_rest=True)
        bare = {key: case.mesh.attributes[key] for key in _FACES if key in case.mesh.attributes}
        athcodec.encode(case.mesh.replace(attributes=bare, metadata=_SCENE), direct, rel_error=rel_error)
        with athcodec.open(skeleton) as plant:
            start = perf_counter()
            moving = athcodec.onto(plant, case.mesh)
            bound = perf_counter()
            figures = _Figures(case)
            for first, block in moving.clip.blocks(8):
                figures.add(block, case.mesh.block(first, first + len(block)))
            took = perf_counter() - bound
            report, bound_facts = moving.report, moving.write_bound(Path(folder, "bound.glb"))
        return {
            "clip": case.name,
            "nodes": case.skeleton.vertex_count,
            "vertices": case.mesh.vertex_count,
            "frames": case.mesh.frame_count,
            "skeleton bytes": skeleton.stat().st_size,
            "mesh bytes": direct.stat().st_size,
            "size": float(np.linalg.norm(np.ptp(case.mesh.rest, axis=0))),
            "far": report.far_count,
            "whole pieces": report.card_count,
            **figures.row(),
            "skeleton stretch": _stretch(case.skeleton),
            "bones": bound_facts["bones"],
            "bones max": bound_facts["max_error"],
            "bind s": bound - start,
            "frame s": took / case.mesh.frame_count,
        }


_FACES = ("face_vertex_counts", "face_vertex_indices")
_SCENE = {"unit": "m", "up_axis": "y"}


class _Figures:
    """Errors, stretch and gaps of a mesh that moves with a skeleton, beside those of its own motion."""

    def __init__(self, case: Case):
        """Prepare to measure a case: find the edges of its mesh with their lengths at rest, and the pairs of vertices
        where stems join.
        """
        self._wood = case.is_wood
        self._meters = ErrorMeter(), ErrorMeter()
        edges = edges_of(case.mesh)
        length = _lengths(case.mesh.rest[None], edges)[0]
        self._edges, self._rest = edges[length > 0], length[length > 0]
        self._stretch: tuple[list[np.ndarray], list[np.ndarray]] = [], []
        self._joints = _joints(case, float(np.median(self._rest)))
        self._apart = _lengths(case.mesh.rest[None], self._joints)[0]
        self._gaps = [0.0, 0.0]

    def add(self, moved: np.ndarray, direct: np.ndarray) -> None:
        """Measure frames `moved` (k, V, 3) of the mesh as the plant moves it against the same frames `direct` (k, V, 3)
        of the mesh's own simulation.
        """
        for meter, some in zip(self._meters, (self._wood, ~self._wood)):
            if some.any():
                meter.add(direct[:, some], moved[:, some])
        for number, frames in enumerate((moved, direct)):
            stretch = np.abs(_lengths(frames, self._edges) / self._rest - 1)
            self._stretch[number].append(stretch.astype(np.float32))
            if len(self._joints):
                wider = float((_lengths(frames, self._joints) - self._apart).max())
                self._gaps[number] = max(self._gaps[number], wider)

    def row(self) -> dict[str, Any]:
        """Return what was measured as a row of the table: distances of wood and leaves, stretch of edges, and gaps at
        joints.
        """
        wood, leaves = self._meters
        stretch, direct = (float(np.quantile(np.concatenate(each), TAIL)) for each in self._stretch)
        row: dict[str, Any] = {"wood max": wood.max_error, "wood RMS": wood.rms_error}
        has_leaves = not self._wood.all()
        row |= {"leaves max": leaves.max_error if has_leaves else None}
        row |= {"leaves RMS": leaves.rms_error if has_leaves else None}
        gaps = self._gaps if len(self._joints) else (None, None)
        return row | {"stretch": stretch, "own stretch": direct, "gap": gaps[0], "own gap": gaps[1]}


def _stretch(clip: athcodec.MotionClip) -> float:
    """Return the stretch of a clip's own edges at the quantile TAIL."""
    edges = edges_of(clip)
    rest = _lengths(clip.rest[None], edges)[0]
    edges, rest = edges[rest > 0], rest[rest > 0]
    strains = [np.abs(_lengths(block, edges) / rest - 1).astype(np.float32) for _, block in clip.blocks(8)]
    return float(np.quantile(np.concatenate(strains), TAIL))


def _lengths(frames: np.ndarray, edges: np.ndarray) -> np.ndarray:
    """Return the lengths (k, E) of edges in frames (k, V, 3)."""
    return np.linalg.norm(frames[:, edges[:, 0]].astype(np.float64) - frames[:, edges[:, 1]], axis=2)


def _joints(case: Case, edge: float) -> np.ndarray:
    """Return pairs of vertices (J, 2) of two stems, one of which grows on the other, that are closer at rest than a
    part of `edge`, the median length of an edge. A mesh without named branches has no such pairs.
    """
    from scipy.spatial import cKDTree

    mesh, wood = case.mesh, np.flatnonzero(case.is_wood)
    if not mesh.has_branches:
        return np.empty((0, 2), np.int64)
    branch, parent = mesh.vertex_branch[wood], mesh.branch_parent
    near, other = cKDTree(case.mesh.rest[wood]).query(case.mesh.rest[wood], k=min(32, len(wood)))
    joined = (parent[branch[other]] == branch[:, None]) | (parent[branch][:, None] == branch[other])
    near = np.where(joined, near, np.inf)
    best = near.argmin(axis=1)
    rows = np.flatnonzero(near[np.arange(len(wood)), best] < JOINT * edge)
    return np.stack([wood[rows], wood[other[rows, best[rows]]]], axis=1)


# ---- the picture ----


def drawn() -> str:
    """Return an SVG, as text, of a skeleton in the wind and of three meshes that move by the skeleton's file."""
    skeleton = data.RECIPES[DRAWN].skeleton()
    encoded = athcodec.encode(skeleton, rel_error=REL_ERROR, exact_rest=True)
    with athcodec.open(encoded) as plant:
        frame = int(np.square(np.asarray(plant) - skeleton.rest).sum(axis=(1, 2)).argmax())
        at_rest, moved = skeleton.rest, plant[frame]
        edges = skeleton.edges
        panels = [
            (
                _lines(at_rest, edges, FADED) + _lines(moved, edges, "#20303c"),
                "skeleton",
                f"{len(moved):,} nodes, {len(encoded) / 1000:.1f} kB",
            )
        ]
        for name, sides, leaves in LODS:
            mesh, faces, wood = _lod(skeleton, sides, leaves)
            with athcodec.onto(plant, mesh, faces=faces) as moving:
                shape = _lines(at_rest, edges, FADED) + _polygons(moving[frame], faces, wood)
            panels.append((shape, name, f"{len(mesh):,} vertices"))
    low, high = np.minimum(at_rest, moved).min(axis=0), np.maximum(at_rest, moved).max(axis=0)
    scale = min(HEIGHT / (high[1] - low[1]), WIDTH / (high[0] - low[0])) * 0.92
    middle = (low[0] + high[0]) / 2
    parts = []
    for number, (shape, name, detail) in enumerate(panels):
        left = MARGIN + number * (WIDTH + MARGIN) + WIDTH / 2
        parts.append(
            f'<g transform="translate({left:.0f} {MARGIN + HEIGHT:.0f})">'
            f'<g transform="scale({scale:.4g} {-scale:.4g}) translate({-middle:.4g} {-low[1]:.4g})">{shape}</g>'
            f'<text y="20">{name}</text><text y="36" class="small">{detail}</text></g>'
        )
    total = len(panels) * (WIDTH + MARGIN) + MARGIN
    style = (
        f"path{{fill:none;stroke-width:{1 / scale:.4g};stroke-linejoin:round}}text{{font:13px sans-serif;"
        "text-anchor:middle;fill:#202c38}.small{font-size:11px}"
    )
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {total} {MARGIN + HEIGHT + CAPTION}">'
        f'<style>{style}</style><rect width="100%" height="100%" fill="#fff"/>{"".join(parts)}</svg>\n'
    )


def _lod(clip: athcodec.MotionClip, sides: int, leaves: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return a mesh around a skeleton at rest, (V, 3), its quads, and which of these are wood."""
    skeleton = Skeleton.of(clip, 1)
    tubes = Tubes(skeleton, sides)
    cards = Leaves(skeleton, SPECIES["broadleaf"], leaves, np.random.default_rng(3))
    points = np.concatenate([tubes.at(skeleton.rest), cards.at(skeleton.rest, cards.unturned())])
    faces = np.concatenate([tubes.faces, tubes.count + cards.faces])
    return points, faces, np.arange(len(faces)) < len(tubes.faces)


def _lines(points: np.ndarray, edges: np.ndarray, colour: str) -> str:
    ends = points[edges, :2].reshape(-1, 4).tolist()
    way = "".join(f"M{x:.3f} {y:.3f}L{to_x:.3f} {to_y:.3f}" for x, y, to_x, to_y in ends)
    return f'<path stroke="{colour}" d="{way}"/>'


def _polygons(points: np.ndarray, faces: np.ndarray, wood: np.ndarray) -> str:
    """Return the SVG polygons of faces (F, 4) seen from the front, the far ones first. `points` is (V, 3), and `wood`
    (F,) tells faces of wood, drawn brown, from those of leaves, drawn green.
    """
    corners = points[faces].astype(np.float64)
    normal = np.cross(corners[:, 2] - corners[:, 0], corners[:, 3] - corners[:, 1])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-12)
    lit = 0.65 + 0.35 * np.abs(normal @ LIGHT)
    colours = np.where(wood[:, None], WOOD, LEAF) * lit[:, None]
    texts = []
    for face in np.argsort(corners[:, :, 2].mean(axis=1)).tolist():
        colour = "#" + "".join(f"{round(part):02x}" for part in colours[face])
        place = " ".join(f"{x:.3f},{y:.3f}" for x, y in corners[face, :, :2])
        texts.append(f'<polygon fill="{colour}" points="{place}"/>')
    return "".join(texts)
