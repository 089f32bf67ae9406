"""REST: welded rest poses, which code vertices at one place once."""

from spec.make.base import *
from spec.make.connected import BY_VERTEX, LEAVES, MANY_FACES, connected, leaves, meshed
from spec.make.layers import refinements
from spec.make.polygons import FACES_3, derived, mixed_polygons, polygons
from spec.make.rest import coded_rest, with_rest


def names_by_chance(seed: int, count: int = 120, corners: int = 3, names: int = 50) -> bytes:
    """Names as polygons, of vertices anywhere, and of some corners behind the last vertex."""
    rows = np.random.default_rng(seed).integers(0, names, (count // corners + 1, corners))
    return polygons(rows.astype("<u4"), count)


def soup(count: int) -> list[list[int]]:
    """Triangles of vertices of their own."""
    return np.arange(count).reshape(-1, 3).tolist()


STRIP = [[i, i + 1, i + 2] if i % 2 else [i + 1, i, i + 2] for i in range(12)]  # Triangles over the places of a soup.
SOUP = [Stem(-1, 18), Stem(0, 18, 17, detail=110)]
LEAF_NAMES = [0, 1, 2, 2, *(v - v % 4 + (v % 4) % 3 for v in range(4, 28)), *range(26, 42), 9, 9]


def broken_welds(front: bytes, method: int = REST_CONNECTED | REST_WELDED) -> Draft:
    chunk = coded_rest(FORK, [], reserved=method >> 2)
    plant = with_rest(FORK, coded_rest(FORK, [])).add(Entry(FACES, polygons(FACES_3)))
    return plant.change(REST, content=chunk[:17] + front)


def sized(welds: bytes, more: int = 0) -> bytes:
    return struct.pack("<I", len(welds) + more) + welds


for title, make in {
    "rest-welded-soup: triangles of vertices of their own, at the places of a strip": lambda: meshed(
        SOUP, soup(36), Chance(601, large=4, begin=[0]), polygons(np.array(STRIP, "<u4"), 36)
    ),
    "rest-welded-chance: names of vertices anywhere, of several branches": lambda: connected(
        MANY_FACES["mixed"], 602, welds=names_by_chance(602)
    ),
    "rest-welded-order: the same of vertices that stand the other way round": lambda: connected(
        MANY_FACES["quads"], 603, order=list(range(119, -1, -1)), welds=names_by_chance(603, corners=7)
    ),
    "rest-welded-exact: an exact rest pose": lambda: connected(
        MANY_FACES["strip"], 604, exact=True, order=[*range(60, 120), *range(60)], welds=names_by_chance(604, names=90)
    ),
    "rest-welded-point: all vertices at one place": lambda: connected(
        MANY_FACES["by chance"], 605, welds=polygons(np.full((120, 1), 119, "<u1"), 120)
    ),
    "rest-welded-apart: each vertex at its own place": lambda: connected(
        MANY_FACES["strip"], 606, welds=polygons(np.arange(119, -1, -1, dtype="<i8").reshape(1, -1), 120)
    ),
    "rest-welded-copies: shapes and copies some of whose vertices share places": lambda: meshed(
        LEAVES, leaves(), Chance(603, large=2, begin=[1]), polygons(np.array(LEAF_NAMES, "<u4").reshape(-1, 2), 44)
    ),
    "rest-welded-mixed: names as polygons of any sizes, four faces and eight corners for each vertex": lambda: meshed(
        FORK,
        [[0, 1, 2], [2, 3, 4]],
        Chance(607, large=5),
        mixed_polygons([[i * k % 3 for k in range(3 if i < 6 else 2 if i < 14 else 1)] for i in range(20)]),
    ),
    "rest-welded-still: a welded rest pose whose stream has no bytes": lambda: meshed(
        FORK, [[0, 1, 2], [2, 3, 4]], [], polygons(np.zeros((5, 1), "<u4"))
    ),
    "rest-welded-layers: a welded rest pose that layers refine": lambda: refinements(
        BY_VERTEX,
        46,
        rest=connected(MANY_FACES["strip"], 608, welds=names_by_chance(608, names=100)).rest,
        faces=MANY_FACES["strip"](),
    ),
}.items():
    valid(title, make)
for title, make in {
    "alone: Method has Is_Welded and not Is_Connected": lambda: broken_welds(sized(polygons(FACES_3)), REST_WELDED),
    "short: three bytes of its size": lambda: broken_welds(b"\0\0\0"),
    "size: fewer bytes than its size": lambda: broken_welds(sized(polygons(np.zeros((5, 1), "<u4")), 1)),
    "empty: polygons without a head": lambda: broken_welds(sized(b"")),
    "few: names of four of five vertices": lambda: broken_welds(sized(polygons(np.zeros((2, 2), "<u4")))),
    "many: more than eight corners for each vertex": lambda: broken_welds(sized(polygons(np.zeros((1, 41), "<u4")))),
    "faces: more than four polygons for each vertex": lambda: broken_welds(sized(polygons(np.zeros((21, 1), "<u4")))),
    "derived: polygons that follow from the stems": lambda: broken_welds(sized(derived("<i4"))),
    "behind: bytes behind the names": lambda: broken_welds(sized(polygons(np.zeros((2, 3), "<u4")) + b"\1" * 12)),
    "beyond: a name that is no vertex's number": lambda: broken_welds(
        sized(polygons(np.array([[0, 1, 2, 3, 5, 0]], "<u4"), 6))
    ),
}.items():
    invalid(f"rest-welded-{title}", make)
invalid(
    "rest-welded-without-faces BAD_CHUNK_TABLE: a welded rest pose, and there are no FACES",
    lambda: with_rest(FORK, coded_rest(FORK, [])).change(
        REST, content=coded_rest(FORK, [], reserved=(REST_CONNECTED | REST_WELDED) >> 2)
    ),
)
