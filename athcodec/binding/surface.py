"""A mesh as points that hang together: vertices at one place are one point, and faces that share a side one piece."""

from __future__ import annotations

import numpy as np

from athcodec.motion.branches.seen import faces_by_sides
from athcodec.motion.places import Places
from athcodec.motion.polygons import sides

SAME_PLACE = 1e-6  # Grid of the points' places, as a share of the mesh's diagonal.


class MeshPoints:
    """The points of a mesh.

    Attributes
    ----------
    place : (P, 3) float64
        The points in the rest pose.
    of_vertex : (V,) int32
        The point of each vertex.
    links : (L, 2) int64
        Pairs of points that a side of a face or an edge joins.
    piece : (P,) int64
        The piece of each point, -1 for one that is in no face. Pieces are what sides of faces connect: a leaf that
        shares one point with its twig is a piece of its own, and that point is the twig's.
    piece_count : int
        Number of pieces.
    shared : (S, 2) int64
        Pieces with each point that they share with the larger piece which has it.
    """

    def __init__(self, rest: np.ndarray, polygons: tuple[np.ndarray, np.ndarray] | None, edges: np.ndarray | None):
        """Merge the vertices `rest` (V, 3) that lie at one place into points, and find the links and connected pieces
        of these. `polygons` has the number of corners of each face, and the vertices of all corners.
        """
        size = float(np.linalg.norm(np.ptp(rest, axis=0)))
        grid = np.round((rest - rest.min(axis=0)) / (SAME_PLACE * size)) if size > 0 else np.zeros_like(rest)
        places = Places.of_labels(grid)
        self.of_vertex, self.place = places.of_vertex, rest[places.first]
        self.piece, self.piece_count = np.full(len(self.place), -1), 0
        self.shared = np.empty((0, 2), np.int64)
        links = [np.empty((0, 2), np.int64)]
        if edges is not None:
            links.append(self.of_vertex[edges].astype(np.int64))
        if polygons is not None and len(polygons[1]):
            counts, corners = np.asarray(polygons[0], np.int64), self.of_vertex[polygons[1]].astype(np.int64)
            side = sides(counts, corners)
            links.append(side)
            self._find_pieces(counts, corners, faces_by_sides(counts, side))
        joined = np.unique(np.sort(np.concatenate(links), axis=1), axis=0)
        self.links = joined[joined[:, 0] != joined[:, 1]]

    def _find_pieces(self, counts: np.ndarray, corners: np.ndarray, piece: np.ndarray) -> None:
        """Number the connected pieces of the mesh and set the piece of each point. `piece` (F,) has a label of the
        piece of each face.
        """
        face, number = np.repeat(np.arange(len(counts)), counts), int(piece.max()) + 1
        # A point of several pieces belongs to the largest of them, which is written last.
        faces = np.bincount(piece, minlength=number)
        first = np.argsort(faces[piece[face]], kind="stable")
        self.piece[corners[first]] = piece[face[first]]
        in_face = self.piece >= 0
        kept, self.piece[in_face] = np.unique(self.piece[in_face], return_inverse=True)
        self.piece_count = len(kept)
        renumbered = np.full(number, -1)
        renumbered[kept] = np.arange(len(kept))
        pairs = np.unique(np.stack([renumbered[piece[face]], corners], axis=1), axis=0)
        self.shared = pairs[(pairs[:, 0] >= 0) & (pairs[:, 0] != self.piece[pairs[:, 1]])]
