"""REST: connected rest poses, which follow FACES."""

from spec.make.base import *
from spec.make.polygons import FACES_3, MANY_FACES, derived, mixed_polygons, polygons
from spec.make.rest import BY_VERTEX, coded_rest, with_rest


def connected(
    make_faces: Callable[[], bytes],
    seed: int = 73,
    step: float = 0.25,
    exact: bool = False,
    order: list | None = None,
    **fields,
) -> Plant:
    """Return a plant with the stems of BY_VERTEX, whose rest pose is coded by its faces. `make_faces` returns the chunk
    of faces, and `step` is the step of the rest pose.
    """
    content, branches, script = make_faces(), branches_of(BY_VERTEX), Chance(seed, large=6)
    count = sum(stem.count for stem in BY_VERTEX)
    mesh = mesh_of(content, order or list(range(count)), fields.get("places"))
    if exact:
        stream = write(rules.decode_exact_rest, script, branches, False, mesh)
        rest = rest_chunk(stream, exact=1, reserved=REST_CONNECTED >> 2)
    else:
        stream = write(rules.decode_rest, script, branches, step, None, mesh)
        rest = rest_chunk(stream, step=step, reserved=REST_CONNECTED >> 2)
    fields |= {} if order is None else {"vertex_source": order}
    return with_rest(BY_VERTEX, rest, faces=content, **fields)


def meshed(stems: list[Stem], faces: list[list[int]], script: list | Chance, **fields) -> Plant:
    """Return a plant whose rest pose is coded by `faces`, lists of vertices of any lengths. `script` has the integers
    of the rest pose, or draws them at random.
    """
    count, step = sum(stem.count for stem in stems), 0.3
    places = fields.get("places")
    content = mixed_polygons(faces, count if places is None else places)
    mesh = mesh_of(content, list(range(count)), places)
    coded = write(rules.decode_rest, script, branches_of(stems), step, None, mesh)
    chunk = rest_chunk(coded, step=step, rest_type=1, reserved=REST_CONNECTED >> 2)
    return with_rest(stems, chunk, faces=content, **fields)


def hub(first: int, quads: int, edges: int) -> list[list[int]]:
    """Return faces whose last vertex completes so many parallelograms at once, and has so many neighbours more."""
    chain = list(range(first, first + 2 * quads + edges))
    middle, across = len(chain) + first + 1, len(chain) + first
    faces = [[middle, chain[2 * i], across, chain[2 * i + 1]] for i in range(quads)]
    faces += [[middle, v] for v in chain[2 * quads :]]
    return faces + [[v, v + 1] for v in chain[:-1]] + ([] if quads else [[chain[-1], across]])


def hubs() -> list[list[int]]:
    """Return the faces of a mesh in which every number of neighbours that the coder tells apart occurs at a vertex."""
    first, faces = 0, []
    for quads, edges in (
        (1, 0),
        (2, 0),
        (2, 2),
        (3, 0),
        (3, 2),
        (4, 0),
        (5, 0),
        (6, 1),
        (7, 0),
        *((0, n) for n in range(1, 11)),
        (1, 7),
    ):
        for _ in range(2):
            faces += hub(first, quads, edges)
            first += 2 * quads + edges + 2
    return faces


def crowd(seed: int) -> list[list[int]]:
    """Return triangles and quadrangles by chance that share many sides, and corners."""
    random = np.random.default_rng(seed)
    faces = [random.integers(0, 16, 3 + (i % 5 == 4)).tolist() for i in range(31)]
    return [*faces, [0, 1, 2], [2, 1, 3], [1, 2, 4], [2, 1, 5], [1, 2, 6], [14, 15, 16], [16, 15, 13]]


LEAVES = [  # on a stem: of four vertices that are shapes or copies, finer ones, and some that others reach into
    Stem(-1, 4),
    *(Stem(0, 4, i % 4, detail=(0, 0, 0, 0, 110, 110, 0, 1, 0, 0)[i]) for i in range(10)),
]


def leaves() -> list[list[int]]:
    """Return faces that make one triangle or quadrilateral of each stem but the last. The last stem has faces of
    several sizes, and its first vertex is in none.
    """
    faces = [[v, v + 1, v + 2, v + 3] if v % 8 else [v, v + 1, v + 2] for v in range(4, 40, 4)]
    return [
        *faces,
        [41, 42, 43],
        [4, 6, 7],
        [15, 12, 20],
        [20, 15, 21],
        [24, 26, 27],
        [33, 37, 38],
        [0, 1],
        [39, 38, 41, 43],
    ]


HUBS = [Stem(-1, 1 + max(map(max, hubs())), lag=1)]


for name_, make_faces in MANY_FACES.items():
    valid(f"rest-connected-{name_.replace(' ', '-')}: a rest pose by faces: {name_}", connected, make_faces)
valid(
    "rest-connected-order: a rest pose by faces of vertices that stand the other way round",
    lambda: connected(MANY_FACES["strip"], order=list(range(119, -1, -1))),
)
valid("rest-connected-tiny: the same, a subnormal Rest_Step", lambda: connected(MANY_FACES["strip"], 74, FLOAT_TINY))
valid("rest-connected-exact: an exact rest pose by faces", lambda: connected(MANY_FACES["quads"], exact=True))
valid("rest-connected-none: a rest pose by no faces", lambda: connected(lambda: polygons(np.zeros((0, 3), "<u2"), 120)))
invalid(
    "rest-connected-without-faces BAD_CHUNK_TABLE: Method has Is_Connected, and there are no FACES",
    lambda: with_rest(FORK, coded_rest(FORK, [], reserved=REST_CONNECTED >> 2)),
)
for word, content in (
    ("broken", lambda: polygons(FACES_3) + b"\0"),
    ("derived", lambda: derived("<i4")),
    ("many-corners", lambda: polygons(np.zeros((1, 41), "<i4"))),
    ("many-faces", lambda: polygons(np.zeros((21, 1), "<i4"))),
):
    invalid(
        f"rest-connected-{word}-faces: a rest pose by faces that do not serve it: {word}",
        lambda content=content: with_rest(FORK, coded_rest(FORK, [], reserved=REST_CONNECTED >> 2)).add(
            Entry(FACES, content())
        ),
    )
for title, make in {
    "rest-connected-own-opposite: a quadrangle whose corners one and three are the same vertex, behind those "
    "between them": lambda: meshed([Stem(-1, 5)], [[3, 0, 3, 1], [0, 1, 2], [2, 3, 4]], Chance(530, large=5)),
    "rest-connected-hubs: vertices that complete up to seven parallelograms, or have up to ten neighbours, and no "
    "other way": lambda: meshed(HUBS, hubs(), Chance(210, large=5)),
    "rest-connected-leaves: by faces shapes, copies, branches that others have begun, and steps of branches of "
    "their own": lambda: meshed(LEAVES, leaves(), Chance(230, large=3, begin=[1])),
    "rest-connected-crowd: triangles and quadrangles of the same sides, and of the same vertex twice": lambda: meshed(
        [Stem(-1, 17)], crowd(211), Chance(212, large=5)
    ),
    "rest-connected-most: a rest pose by four faces and eight corners for each vertex": lambda: meshed(
        FORK,
        [[(i + k * (1 + i % 3)) % 5 for k in range(3 if i < 6 else 2 if i < 14 else 1)] for i in range(20)],
        Chance(506, large=5),
    ),
}.items():
    valid(title, make)
