"""FACES and EDGES."""

from spec.make.base import *
from spec.make.rest import BY_VERTEX, coded_rest, with_rest
from spec.make.static import numbers, static, with_static


def polygon_type(name: str) -> int:
    """Return a type of integers as FACES and EDGES number them."""
    return "1248".index(name[2]) | 4 * (name[1] == "i")


def polygon_head(type_: str, faces: int, corners: int, count_type: str | None = None, flags: int = 0) -> bytes:
    """Return the head of polygons. corners: of each face, or where there is a count_type of all."""
    mixed = b"" if count_type is None else bytes([polygon_type(count_type)])
    return bytes([polygon_type(type_) | flags | 8 * len(mixed)]) + mixed + struct.pack("<II", faces, corners)


def polygon_shape(index_type: int, count_type: int | None, face_count: int, columns: int, corner_count: int):
    """Return the head of a chunk FACES or EDGES: the types of its indices and counts, the number of faces, the columns
    of a table of faces (0: mixed sizes), and the number of corners.
    """
    return rules.Record(
        index_type=index_type,
        count_type=count_type,
        is_derived=False,
        face_count=face_count,
        columns=columns,
        corner_count=corner_count,
    )


def polygons(rows: np.ndarray, places: int | list = 5, script: Script | None = None) -> bytes:
    """Return FACES or EDGES with as many corners each. places: of each vertex, or how many that share none."""
    shape = polygon_shape(polygon_type(rows.dtype.str), None, *rows.shape, rows.size)
    places = range(places) if isinstance(places, int) else places
    stream = write(rules.decode_polygons, script or rows.reshape(-1).tolist(), shape, places)
    return polygon_head(rows.dtype.str, *rows.shape) + stream


def mixed_polygons(
    faces: list[list[int]],
    places: int | list = 5,
    types: tuple[str, str] = ("<u4", "|u1"),
    corner_count: int | None = None,
) -> bytes:
    """Return FACES of different sizes; types: of vertices and numbers of corners."""
    corners = sum(map(len, faces)) if corner_count is None else corner_count
    index_type, count_type = map(polygon_type, types)
    shape = polygon_shape(index_type, count_type, len(faces), 0, corners)
    script = [value for face in faces for value in (len(face), *face)]
    places = range(places) if isinstance(places, int) else places
    return polygon_head(types[0], len(faces), corners, types[1]) + write(rules.decode_polygons, script, shape, places)


def derived(type_: str) -> bytes:
    return bytes([polygon_type(type_) | 16])


FACES_3 = np.array([[0, 1, 2], [2, 1, 4]], "<u2")
EDGES_2 = np.array([[0, 1], [4, 3]], "<i8")
MANY_FACES = {  # Faces of 119 vertices, those of BY_VERTEX.
    "by chance": lambda: polygons(np.zeros((150, 3), "<i2"), 120, script=Chance(71)),
    "strip": lambda: polygons(np.array([[i, i + 1, i + 2] for i in range(118)], "<i4"), 120),
    "quads": lambda: polygons(np.array([[i, i + 1, i + 11, i + 10] for i in range(109)], "<i8"), 120),
    "mixed": lambda: mixed_polygons(
        [[(7 * i + k * k) % 120 for k in range((3, 4, 3, 5, 0, 1, 4, 2, 40)[i % 9])] for i in range(60)], 120
    ),
}


def faces(content: bytes) -> Callable[[], Draft]:
    return lambda: with_static((FACES, content))


def edges(content: bytes) -> Callable[[], Draft]:
    return lambda: with_static((EDGES, content))


def recent(_: bytes) -> None:
    """Run FORMAT.md's model of faces on a script of decisions for one triangle, whose first corner is guessed to be
    vertex 0, and one of whose corners is chosen from the list of the most recent corners by its place in the list. The
    argument, the bytes of a vector, is not used.
    """
    coder, model = rules.RangeDecoder(b""), rules.PolygonModel(range(5))
    decisions = [(model.guessed[1][0][0], 1), (model.guessed[1][1][2], 0), (model.is_recent[1], 1)]
    node = 1
    for bit in (0, 0, 0, 0, 1):
        decisions.append((model.recent[1][node], bit))
        node = node << 1 | bit
    decisions.append((model.guessed[1][2][15], 1))
    coder.script = Script(*(bit for _, bit in decisions))
    for context, _ in decisions:
        coder.bit(context)


STRIPS = {
    "up": [[i, i + 1, i + 2] for i in range(18)],
    "down": [[i, i - 1, i - 2] for i in range(19, 1, -1)] + [[1, 0, 2], [3, 4, 0]],
}


def derived_edges(*counts: int) -> Draft:
    return still([Stem(-1, count) for count in counts]).add(Entry(EDGES, derived("|i1")))


for title, make in {
    "faces-and-edges: triangles and edges, in integers of different sizes": lambda: with_static(
        (FACES, polygons(FACES_3)), (EDGES, polygons(EDGES_2))
    ),
    "faces-of-any-width: faces of five columns": lambda: with_static(
        (FACES, polygons(np.array([[4, 3, 2, 1, 0]], "<i4")))
    ),
    "faces-none: no faces: three columns, no rows, no data; edges without rows likewise": lambda: with_static(
        (FACES, polygons(np.zeros((0, 3), "|u1"))), (EDGES, polygons(np.zeros((0, 2), "<u4")))
    ),
    "edges-derived: edges that the hierarchy implies, in a file with permutations": lambda: moving(
        [Stem(-1, 3), Stem(0, 2, 1), Stem(-1, 1)], 61, vertex_source=[5, 0, 3, 1, 4, 2]
    ).add(Entry(EDGES, derived("<i2"))),
    "edges-derived-least: as numbers of one byte; of one vertex there are none": lambda: lone().add(
        Entry(EDGES, derived("|i1"))
    ),
    "faces-mixed: faces of 3, 4, 0, 1, 2 and 5 corners, numbers of one byte and of eight": lambda: with_static(
        (FACES, mixed_polygons([[0, 1, 2], [3, 2, 1, 0], [], [4], [4, 3], [0, 1, 2, 3, 4]], types=("<i8", "|i1")))
    ),
    "faces-mixed-alike: faces that could be of different sizes, but are triangles; attributes behind them": lambda: (
        with_static((FACES, mixed_polygons([[0, 1, 2], [2, 1, 4]]))).add(
            Entry(ATTRIBUTE, numbers(np.arange(5.0), name="radius"))
        )
    ),
    "faces-mixed-none: no faces of different sizes": lambda: with_static((FACES, mixed_polygons([]))),
}.items():
    valid(title, make)


for name_, make_faces in MANY_FACES.items():
    valid(
        f"faces-many-{name_.replace(' ', '-')}: faces of 120 vertices: {name_}",
        lambda make_faces=make_faces: with_rest(BY_VERTEX, coded_rest(BY_VERTEX, [])).add(Entry(FACES, make_faces())),
    )
static("faces-empty: FACES without bytes", faces(b""))
static("faces-short: FACES of 8 bytes", faces(polygon_head("<i4", 0, 3)[:8]))
static("faces-mixed-short: FACES of 9 bytes with Is_Mixed", faces(polygon_head("<i4", 0, 0, "<i4")[:9]))
static("faces-derived: FACES cannot be derived", faces(derived("<i4")))
static("faces-reserved: bit 7 of Index_Type is set", faces(polygon_head("<i4", 0, 3, flags=128)))
static("faces-reserved-5: bit 5 of Index_Type is set", faces(polygon_head("<u2", 0, 3, flags=32)))
static("faces-count-type: Count_Type has bit 3 set", faces(bytes([8, 8]) + bytes(8)))
static("faces-count-reserved: Count_Type has bit 4 set", faces(bytes([8, 16]) + bytes(8)))
static("faces-beyond: a face of a vertex behind the last", faces(polygons(np.array([[0, 1, 5]], "<u4"))))
static("faces-negative: a face of vertex -1", faces(polygons(np.array([[0, 1, -1]], "<i2"))))
static("faces-too-many LIMIT_EXCEEDED: 2^32 - 1 faces", faces(polygon_head("<i4", 2**32 - 1, 3)))
static("faces-too-wide LIMIT_EXCEEDED: 2^26 + 1 columns of no rows", faces(polygon_head("<i4", 0, 2**26 + 1)))
static("faces-too-large LIMIT_EXCEEDED: 2^13 faces of 2^13 corners", faces(polygon_head("<i4", 2**13, 2**13)))
static("faces-mixed-too-many LIMIT_EXCEEDED: a face and 2^26 corners", faces(polygon_head("<i4", 1, 2**26, "<i4")))
static("faces-more-corners: a face of more corners than are left", faces(mixed_polygons([[0, 1, 2]], corner_count=2)))
static("faces-fewer-corners: corners of no face", faces(mixed_polygons([[0, 1, 2]], corner_count=4)))
static(
    "faces-count-beyond-type: a face of 128 corners, of which |i1 holds 127",
    faces(mixed_polygons([[0, 1, 2, 3] * 32], types=("<u4", "|i1"))),
)
static(
    "faces-beyond-type: a face of vertex 128, which |i1 does not hold",
    lambda: moving([Stem(-1, 64), Stem(-1, 64), Stem(-1, 2)], 2, frames=1).add(
        Entry(FACES, polygons(np.array([[0, 127, 128]], "<i2"), 130).replace(b"\x05", b"\x04", 1))
    ),
)
static("faces-zero-behind: a zero byte behind the stream", faces(polygons(FACES_3) + b"\0"))
static("faces-bytes-behind: bytes behind the stream", faces(polygons(FACES_3) + b"\1" * 12))
static("edges-three-columns: edges of three columns", edges(polygons(np.zeros((1, 3), "<i4"))))
static("edges-mixed: edges of different sizes", edges(mixed_polygons([[0, 1]])))
static("edges-beyond: an edge to a vertex behind the last", edges(polygons(np.array([[0, 5]], "<u2"))))
static("edges-derived-mixed: Is_Derived with Is_Mixed", edges(bytes([2 | 16 | 8])))
static("edges-derived-reserved: derived edges, and bit 5 is set", edges(bytes([16 | 32])))
static(
    "edges-derived-small: 130 vertices do not fit |i1",
    lambda: moving([Stem(-1, 64), Stem(-1, 64), Stem(-1, 2)], 2, frames=1).add(Entry(EDGES, derived("|i1"))),
)
static("edges-derived-with-data: data behind derived edges", edges(derived("<i4") + bytes(8)))
valid("faces-none-widest: no faces of 2^26 corners each", lambda: with_static((FACES, polygon_head("<u4", 0, 1 << 26))))
valid(
    "faces-of-most-corners: faces of as many corners as Count_Type holds",
    lambda: with_static((FACES, mixed_polygons([[0, 1, 2], [i % 5 for i in range(127)]], types=("<u4", "|i1")))),
)
static(
    "faces-more-corners-of-many: the second of two faces has one corner more than are left, of 2^25: none is decoded",
    faces(
        polygon_head("<u4", 2, MANY_CORNERS, "<u4")
        + write(
            *(rules.decode_polygons, [42, *[0, 1, 2] * 14, MANY_CORNERS - 41]),
            *(polygon_shape(2, 2, 2, 0, MANY_CORNERS), range(5)),
            lowest=True,
        )
    ),
)
static(
    "faces-recent-before-first: the second corner is the one before the first",
    lambda: with_static((FACES, polygon_head("<u4", 1, 3) + write(recent, []))),
)
for name, strip in STRIPS.items():
    valid(
        f"faces-{name}-and-on: triangles {'up to the last vertex' if name == 'up' else 'down to vertex 0'}, beyond "
        "which the same ways would lead",
        lambda strip=strip: moving([Stem(-1, 20)], 501, frames=1).add(
            Entry(FACES, polygons(np.array(strip + [[7, 3, 9]], "<u2"), 20))
        ),
    )
valid(
    "faces-of-8-bytes: vertices and numbers of corners in 8 bytes: behind their largest one is none of 64 bits",
    lambda: with_static(
        (FACES, mixed_polygons([[0, 1, 2], [3, 2, 1, 0], [4]], types=("<u8", "<u8"))),
        (EDGES, polygons(np.array([[0, 1], [4, 3]], "<u8"))),
    ),
)
valid(
    "faces-of-8-bytes-signed: the same with signs; edges that the hierarchy implies",
    lambda: with_static(
        (FACES, mixed_polygons([[0, 1, 2], [3, 2, 1, 0], [4]], types=("<u8", "<i8"))), (EDGES, derived("<u8"))
    ),
)
for title, make in {
    "faces-of-8-bytes-beyond: vertex 2^30 - 1, in 8 bytes": faces(polygons(np.array([[0, 1, (1 << 30) - 1]], "<u8"))),
    "faces-of-8-bytes-negative: vertex -1 in 8 bytes without a sign": faces(
        polygons(np.array([[0, 1, -1]], "<i8")).replace(b"\x07", b"\x03", 1)
    ),
    "faces-of-8-bytes-count: a face of 2^30 - 1 corners, a number of 8 bytes": faces(
        polygon_head("<u8", 1, 3, "<u8")
        + write(rules.decode_polygons, [(1 << 30) - 1], polygon_shape(3, 3, 1, 0, 3), range(5))
    ),
    "edges-of-8-bytes-beyond: an edge to vertex 5 of 5": edges(polygons(np.array([[0, 5]], "<u8"))),
}.items():
    static(title, make)

valid(
    "edges-derived-127: derived edges of 128 vertices, the last of which is the largest number of |i1",
    lambda: derived_edges(*[2] * 64),
)
invalid("edges-derived-128 BAD_CHUNK static: 129 vertices do not fit |i1", lambda: derived_edges(*[2] * 63, 3))
