"""HIERARCHY: branches, permutations."""

from spec.make.base import *

BLADES = [Stem(-1, 3), Stem(-1, 4), Stem(-1, 2), Stem(-1, 3)]


def interleaved(stems: list[Stem]) -> list[int]:
    """Return numbers of the vertices in a source that holds all first vertices, then all second ones."""
    places = [(i, b) for b, stem in enumerate(stems) for i in range(stem.count)]
    return np.argsort(sorted(range(len(places)), key=places.__getitem__)).tolist()


def hierarchy(title: str, stems: list[Stem], **sources) -> None:
    """Declare a HIERARCHY for the five vertices and two branches of the fork, or for as many branches as there are."""

    def make() -> Draft:
        stream = write(rules.decode_hierarchy, hierarchy_script(stems, **sources), len(stems), 5)
        return fork().with_header(branch_count=len(stems)).change(HIERARCHY, content=stream)

    invalid(f"hierarchy-{title}", make)


for title, make in {
    "two-roots: two plants: a root in the middle of the file": lambda: moving(
        [Stem(-1, 3), Stem(0, 2, 1), Stem(-1, 4), Stem(2, 1, 3)], 7, heads=HEADS
    ),
    "many-roots: roots alone, each a node by its first modes": lambda: moving(
        [Stem(-1, 1), Stem(-1, 2), Stem(-1, 3), Stem(-1, 1, 0, SHEET)], 8, heads=HEADS
    ),
    "chain: the deepest hierarchy of nodes that there can be: 31 branches, each on the one before, 32 levels": lambda: (
        moving(chain(31), 9, heads=HEADS)
    ),
    "chain-in-whole: a chain of 40 branches in a WHOLE subtree: nodes end where it begins": lambda: moving(
        [Stem(-1, 2), *(replace(s, parent=b, flags=WHOLE if b == 0 else 0) for b, s in enumerate(chain(40)))],
        10,
        heads=HEADS,
    ),
    "depth-4096: branches as deep as the limit allows, of which level 0 is stored": lambda: still(
        [replace(s, flags=WHOLE if b == 0 else 0) for b, s in enumerate(chain(4096))], points=[[0.0] * 3] * 4096
    ).upto(0),
    "whole: WHOLE subtrees: a root's, a branch's, and that of a branch alone, shown till the last level": lambda: (
        moving(stems_of("-1 3, 0 2 1, 1 2 1 WHOLE, 2 1, 0 2 2 WHOLE, -1 2 0 WHOLE, 5 3 1"), 11, heads=HEADS)
    ),
    "whole-alone: a root that is WHOLE and all there is: h is 0": lambda: moving(
        [Stem(-1, 3, 0, WHOLE)], 12, heads=HEADS
    ),
    "unturned: branches whose bending turns nothing: beams, sheets, a tube, rigid and WHOLE ones": lambda: moving(
        UNTURNED, 13, heads=HEADS
    ),
    "permutations: branches and vertices numbered otherwise in the source": lambda: moving(
        [Stem(-1, 3), Stem(0, 2, 1), Stem(0, 1, 2)], 22, branch_source=[2, 0, 1], vertex_source=[5, 0, 3, 1, 4, 2]
    ),
    "permutation-of-branches: branches numbered otherwise, vertices as that lets one expect": lambda: moving(
        FORK, 23, branch_source=[1, 0]
    ),
    "permutations-said: numbers as expected, but said one by one": lambda: still(
        FORK, branch_source=[0, 1], vertex_source=[0, 1, 2, 3, 4]
    ),
    "permutation-interleaved: all first vertices in front of all second ones, of stems of different lengths": lambda: (
        still(BLADES, vertex_source=interleaved(BLADES))
    ),
    "permutation-interleaved-long: the same of two stems of more vertices than numbers are remembered of": lambda: (
        still([Stem(-1, 259), Stem(-1, 260)], vertex_source=interleaved([Stem(-1, 259), Stem(-1, 260)]))
    ),
    "permutation-turned: stems from tip to base": lambda: still(
        BLADES, vertex_source=[v for a, b in ((0, 3), (3, 7), (7, 9), (9, 12)) for v in range(a, b)[::-1]]
    ),
}.items():
    valid(title, make)

invalid(
    "hierarchy-31-deep BAD_HEADER: 32 branches, each on the one before: no Full_Level_Count can say 33",
    lambda: moving(chain(32), 1).upto(31).with_header(full_level_count=32),
)
invalid(
    "hierarchy-before-rest: HIERARCHY is not valid and REST is damaged: HIERARCHY comes first",
    lambda: fork().change(HIERARCHY, content=b"").change(REST, checksum=0),
)
prelude(HIERARCHY, "empty: no bytes", b"")
prelude(HIERARCHY, "zero-behind: a zero byte behind the stream", lambda: fork().content(HIERARCHY) + b"\0")
prelude(HIERARCHY, "bytes-behind: bytes behind the stream", lambda: fork().content(HIERARCHY) + b"\1" * 12)
invalid(
    "hierarchy-above-root: a parent above the root",
    lambda: fork().change(HIERARCHY, content=write(rules.decode_hierarchy, [2, 0, 0, 0, 1, 2], 2, 5)),
)
hierarchy("too-many-vertices: stems have more vertices than the file", [Stem(-1, 4), Stem(0, 3)])
hierarchy("too-few-vertices: stems have fewer vertices than the file", [Stem(-1, 3), Stem(0, 1)])
hierarchy("no-vertex-left: nothing is left for the last stem", [Stem(-1, 5), Stem(0, 1)])
hierarchy("lag-negative: Lag -1", [Stem(-1, 3), Stem(0, 2, 1, lag=-1)])
hierarchy("lag-65536: Lag 65536", [Stem(-1, 3, lag=65536), Stem(0, 2, 1)])
hierarchy("rigid-negative: Rigid -1", [Stem(-1, 3, rigid=1), Stem(0, 2, 1, rigid=-1)])
hierarchy("rigid-9: Rigid 9", [Stem(-1, 3), Stem(0, 2, 1, rigid=9)])
hierarchy("detail-negative: Detail -1", [Stem(-1, 3, detail=1), Stem(0, 2, 1, detail=-1)])
hierarchy("detail-256: Detail 256", [Stem(-1, 3), Stem(0, 2, 1, detail=256)])
hierarchy("ring-negative: Ring -1", [Stem(-1, 3, 0, SHEET, ring=2), Stem(0, 2, 1, SHEET, ring=-1)])
hierarchy("ring-1: Ring 1", [Stem(-1, 3), Stem(0, 2, 1, SHEET, ring=1)])
hierarchy("ring-33: Ring 33", [Stem(-1, 3), Stem(0, 2, 1, SHEET, ring=33)])
hierarchy("ring-of-beam: a branch that is no SHEET has a Ring", [Stem(-1, 3), Stem(0, 2, 1, ring=2)])
hierarchy(
    "root-loose BAD_CHUNK_TABLE: a root is LOOSE, and nothing says how its tree moves",
    [Stem(-1, 3, 0, LOOSE), Stem(0, 2, 1)],
)
hierarchy(
    "second-root-loose BAD_CHUNK_TABLE: another root is LOOSE, and nothing says how its tree moves",
    [Stem(-1, 3), Stem(-1, 2, 0, LOOSE)],
)
hierarchy(
    "whole-in-whole: a WHOLE branch in the subtree of another",
    [Stem(-1, 2), Stem(0, 1, 0, WHOLE), Stem(1, 1), Stem(2, 1, 0, WHOLE)],
)
hierarchy("attach-beyond: a branch hangs behind the end of its parent", [Stem(-1, 3), Stem(0, 2, 3)])
hierarchy("attach-before: a branch hangs before the beginning of its parent", [Stem(-1, 3), Stem(0, 2, -1)])
hierarchy("attach-far: a step of 2^28 + 1 along the parent", [Stem(-1, 3), Stem(0, 2, (1 << 28) + 1)])
hierarchy("branch-twice: two branches with the same number", [Stem(-1, 3), Stem(0, 2, 1)], branch_source=[1, 1])
hierarchy("branch-beyond: a branch with a number beyond the last", [Stem(-1, 3), Stem(0, 2, 1)], branch_source=[0, 2])
hierarchy("branch-negative: a branch with a number below 0", [Stem(-1, 3), Stem(0, 2, 1)], branch_source=[-1, 0])
hierarchy(
    "vertex-twice: two vertices with the same number", [Stem(-1, 3), Stem(0, 2, 1)], vertex_source=[0, 1, 2, 3, 3]
)
hierarchy(
    "vertex-beyond: a vertex with a number beyond the last", [Stem(-1, 3), Stem(0, 2, 1)], vertex_source=[0, 1, 2, 3, 5]
)
hierarchy(
    "vertex-negative: a vertex with a number below 0", [Stem(-1, 3), Stem(0, 2, 1)], vertex_source=[-1, 0, 1, 2, 3]
)
for word, vertex_source in (
    ("along-beyond", [0, 3, 6, 1, 2]),
    ("along-negative", [4, 1, -2, 0, 3]),
    ("beside-beyond", [1, 3, 0, 4, 6]),
    ("beside-negative", [3, 1, 4, 0, -2]),
):
    hierarchy(
        f"vertex-{word}: a number out of range, as expected", [Stem(-1, 3), Stem(0, 2, 1)], vertex_source=vertex_source
    )
invalid(
    "hierarchy-depth-limit LIMIT_EXCEEDED: 4097 branches, each on the one before",
    lambda: still(
        [replace(s, flags=WHOLE if b == 0 else 0) for b, s in enumerate(chain(4097))], points=[[0.0] * 3] * 4097
    ).upto(0),
)
for name_, reason_, stems_ in (  # Streams that go on behind what is refused, as if nothing were wrong.
    ("lag-65536", "Lag 65536", "-1 3, 0 2 1 lag=65536"),
    ("ring-1", "Ring 1", "-1 3, 0 2 1 SHEET ring=1"),
    ("ring-of-beam", "a branch that is no SHEET has a Ring", "-1 3, 0 2 1 ring=2"),
    ("attach-before", "an attach vertex before the parent's stem", "-1 2, -1 2, 1 2 -1"),
):
    invalid(
        f"hierarchy-{name_}-in-whole-stream: {reason_}, in a stream that is whole",
        lambda stems_=stems_: not_refused(lambda: still(stems_of(stems_)).draft()),
    )
