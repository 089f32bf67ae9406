"""PLACES: vertices that coincide, and what is handed out for each of them."""

from spec.make.base import *
from spec.make.connected import LEAVES, connected, leaves, meshed
from spec.make.layers import refinements
from spec.make.polygons import derived, mixed_polygons, polygons
from spec.make.rest import BY_VERTEX, coded_rest, with_rest


def in_turn(numbers: list[int]) -> list[int]:
    """Return numbers renamed in the order in which they first occur."""
    order = list(dict.fromkeys(numbers))
    return [order.index(number) for number in numbers]


def by_chance(seed: int, count: int, more: int, near: int | None = None) -> list[int]:
    """Return so many places, and vertices more that share them; near: how far back those are at most."""
    random, places = np.random.default_rng(seed), list(range(count))
    for _ in range(more):
        at = int(random.integers(1, len(places) + 1))
        back = int(random.integers(1, min(near or at, at) + 1))
        places.insert(at, places[at - back])
    return in_turn(places)


STRIP = [v for i in range(16) for v in ([i, i + 1, i + 2] if i % 2 else [i + 1, i, i + 2])]  # Corners of triangles.
FIVE = [0, 1, 1, 2, 0, 3, 4, 4, 2]  # Places of nine vertices of FORK.
CROWD = in_turn([0, *[1] * 40, 2, *[3] * 17, 4, 1, 3])


def split(stems: list[Stem], places: list[int], seed: int, **fields) -> Plant:
    return moving(stems, seed, **{"places": places, "heads": HEADS} | fields)


def of_five(**fields) -> Plant:
    return split(FORK, FIVE, 701, **{"frames": 2} | fields)


def with_places(content: bytes) -> Callable[[], Draft]:
    return lambda: of_five().change(PLACES, content=content)


def jumps(data: bytes) -> None:
    """Decode corners of which the second vertex has place 2, and the first 0."""
    rules.decode_polygons(
        data, rules.Record(index_type=2, count_type=None, face_count=9, columns=1, corner_count=9), range(5)
    )


def rows_by_chance(seed: int, rows: int, columns: int, vertices: int) -> np.ndarray:
    return np.random.default_rng(seed).integers(0, vertices, (rows, columns)).astype("<u4")


MANY = by_chance(702, 120, 140, near=30)  # Places of BY_VERTEX.
LEAF_PLACES = by_chance(703, sum(stem.count for stem in LEAVES), 30)
MESH_OF_FIVE = np.array([[v, v * v, -v] for v in range(5)], "<f4")[FIVE]
TWINS_DIFFER = MESH_OF_FIVE + np.array([[0, 0, v // 4] for v in range(9)], "<f4")
MESH_OF_FIVE[4, 0] = -0.0

for title, make in {
    "places-strip: a place for each corner of a strip of triangles, which are their faces": lambda: split(
        [Stem(-1, 9), Stem(0, 9, 4)], in_turn(STRIP), 704
    ).add(Entry(FACES, polygons(np.arange(48, dtype="<u4").reshape(-1, 3), in_turn(STRIP)))),
    "places-rows-of-1: vertices by chance in one column": lambda: split(FORK, FIVE, 705, columns=1),
    "places-rows-of-255: rows of more columns than there are vertices": lambda: split(FORK, FIVE, 706, columns=255),
    "places-last-row: rows of four columns, the last of one": lambda: split(FORK, FIVE, 707, columns=4),
    "places-order: vertices of which file order is another one": lambda: of_five(vertex_source=[3, 0, 4, 1, 2]),
    "places-far: places that lie anywhere before": lambda: split(
        BY_VERTEX, by_chance(708, 120, 300), 708, frames=1, columns=1
    ),
    "places-point: all vertices at one place": lambda: split([Stem(-1, 1)], [0] * 20, 709),
    "places-layers: three layers of a file with places": lambda: refinements(BY_VERTEX, 46, places=MANY),
    "places-segments: clips, segments and repeats": lambda: of_five(
        clips=(Clip(6, 2, "a"), Clip(2, 1, "b")), repeats=(0, 1, 0, 0, 1, 0, 0, 0)
    ),
    "places-binary64: positions of binary64, some of them in single parts": lambda: of_five(is_float64=True),
    "places-edges-derived: edges that follow from the stems, between the first vertices of places": lambda: of_five(
        vertex_source=[3, 0, 4, 1, 2]
    ).add(Entry(EDGES, derived("<i4"))),
    "places-edges: edges between any vertices": lambda: of_five().add(
        Entry(EDGES, polygons(np.array([[0, 4], [8, 1], [2, 3], [7, 6], [4, 0]], "<u2"), FIVE))
    ),
    "faces-of-places: triangles and quadrangles of vertices that share places": lambda: split(
        BY_VERTEX, MANY, 710, frames=1
    ).add(Entry(FACES, mixed_polygons([[(5 * i + k * k) % 260 for k in range(3 + i % 2)] for i in range(90)], MANY))),
    "faces-of-places-by-chance: corners anywhere": lambda: split(BY_VERTEX, MANY, 711, frames=1).add(
        Entry(FACES, polygons(rows_by_chance(711, 120, 3, 260), MANY))
    ),
    "faces-of-places-decided: corners by chance in their stream": lambda: split(BY_VERTEX, MANY, 712, frames=1).add(
        Entry(FACES, polygons(np.zeros((150, 4), "<i2"), MANY, script=Chance(712)))
    ),
    "faces-of-places-crowd: places of 17 vertices and more, of which a guess means the first 16": lambda: split(
        FORK, CROWD, 713, frames=1
    ).add(Entry(FACES, polygons(rows_by_chance(713, 90, 3, len(CROWD)), CROWD))),
    "faces-of-places-fans: corners around one place, with a vertex of their own in each triangle": lambda: split(
        [Stem(-1, 8)], in_turn([v for i in range(7) for v in (0, 1 + i, 1 + (i + 1) % 7)]), 714, frames=1
    ).add(
        Entry(
            FACES,
            polygons(
                np.arange(21, dtype="<u4").reshape(-1, 3)[::-1],
                in_turn([v for i in range(7) for v in (0, 1 + i, 1 + (i + 1) % 7)]),
            ),
        )
    ),
    "rest-connected-places: a rest pose by faces of vertices that share places": lambda: connected(
        lambda: polygons(np.arange(258, dtype="<u4").reshape(-1, 3), MANY), 715, places=MANY
    ),
    "rest-connected-places-exact: the same in exact numbers, of another file order": lambda: connected(
        lambda: polygons(np.arange(258, dtype="<u4").reshape(-1, 3), MANY),
        716,
        exact=True,
        order=[*range(60, 120), *range(60)],
        places=MANY,
    ),
    "rest-connected-places-leaves: shapes and copies by faces": lambda: meshed(
        LEAVES,
        [[LEAF_PLACES.index(v) for v in face] for face in leaves()],
        Chance(720, large=3, begin=[1]),
        places=LEAF_PLACES,
    ),
    "rest-connected-places-most: four faces and eight corners for each place": lambda: meshed(
        FORK,
        [[(i + k * (1 + i % 3)) % 9 for k in range(3 if i < 6 else 2 if i < 14 else 1)] for i in range(20)],
        Chance(718, large=5),
        places=FIVE,
    ),
}.items():
    valid(title, make)
valid(
    "places-host-mesh: the host's mesh, of which the first vertex of each place counts",
    lambda: of_five(mesh=MESH_OF_FIVE),
    mesh=MESH_OF_FIVE,
)
valid(
    "places-host-mesh-apart: a host's mesh whose vertices of one place differ",
    lambda: of_five(mesh=TWINS_DIFFER, vertex_source=[3, 0, 4, 1, 2]),
    mesh=TWINS_DIFFER,
)
invalid(
    "places-host-mesh-short: a mesh with one vertex for each place",
    lambda: of_five(mesh=MESH_OF_FIVE),
    "WRONG_HOST_MESH",
    0,
    MESH_OF_FIVE[:5],
)
for title, content in {
    "places-empty: PLACES without bytes": b"",
    "places-no-columns: Columns 0": b"\0" + places_chunk(FIVE, 5)[1:],
    "places-jump: a place that is not the next one": b"\1" + write(jumps, [0, 2, 1, 3, 4, 0, 1, 2, 3]),
    "places-missing-last: no vertex at the last place": b"\1" + write(jumps, [0, 1, 2, 3, 0, 1, 2, 3, 3]),
    "places-bytes-behind: bytes behind the stream": places_chunk(FIVE, 5) + b"\1" * 12,
    "places-zero-behind: a zero byte behind the stream": places_chunk(FIVE, 5) + b"\0",
}.items():
    invalid(title, with_places(content))
invalid(
    "places-needless BAD_CHUNK_TABLE: PLACES where each vertex has its own",
    lambda: moving(FORK, 701, frames=2).add(Entry(PLACES, places_chunk([0, 1, 2, 3, 4], 5))),
)
invalid("places-none BAD_CHUNK_TABLE: vertices share places, and there is no PLACES", lambda: of_five().without(PLACES))
invalid(
    "places-optional UNKNOWN_CHUNK: PLACES with the bit Optional",
    lambda: of_five().without(PLACES).add(Entry(0x8008, places_chunk(FIVE, 5))),
)
invalid(
    "faces-optional UNKNOWN_CHUNK: FACES with the bit Optional",
    lambda: fork().add(Entry(0x8005, polygons(np.array([[0, 1, 2]], "<u2")))),
)
invalid(
    "places-limit LIMIT_EXCEEDED: 2^26 + 1 vertices at 5 places",
    lambda: of_five().with_header(vertex_count=(1 << 26) + 1),
)
invalid(
    "places-memory-limit LIMIT_EXCEEDED: vertices that share places take more than Max_Memory_Bytes",
    lambda: of_five().with_header(vertex_count=1 << 26),
)
invalid(
    "places-branches BAD_HEADER: as many branches as vertices, which is more than places",
    lambda: of_five().with_header(branch_count=9),
)
invalid(
    "rest-connected-places-many-corners: more than eight corners for each place",
    lambda: with_rest(FORK, coded_rest(FORK, [], reserved=REST_CONNECTED >> 2), places=FIVE).add(
        Entry(FACES, polygons(np.zeros((1, 41), "<i4"), FIVE))
    ),
)
invalid(
    "faces-of-places-beyond BAD_CHUNK static: a face of a vertex behind the last",
    lambda: of_five().add(Entry(FACES, polygons(np.array([[0, 1, 9]], "<u4"), FIVE))),
)
invalid(
    "faces-of-places-beyond-type BAD_CHUNK static: a guess that means vertex 128, which |i1 does not hold",
    lambda: split([Stem(-1, 1)], [0] * 130, 719, frames=1).add(
        Entry(FACES, polygons(np.array([[127, 126, 125], [128, 1, 2]], "<i2"), [0] * 130).replace(b"\x05", b"\x04", 1))
    ),
)
valid(
    "places-no-bytes: PLACES without a stream: its decisions are ones, and both vertices are at the one place",
    lambda: split([Stem(-1, 1)], [0, 0], 710, columns=1),
)
