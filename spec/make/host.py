"""REST: the host's mesh as the rest pose."""

from spec.make.base import *
from spec.make.layers import layered
from spec.make.rest import AWKWARD_FLOATS

MESH = np.array(grown(FORK, 5), "<f4") / 4 + np.float32(0.1)
ORDER = [3, 0, 4, 1, 2]  # Order of the fork's vertices in the source.


def hosted(mesh: np.ndarray = MESH, **fields) -> Plant:
    """Return the fork, whose rest pose is the host's mesh; its vertices stand in another order in the source."""
    return forked(**{"mesh": mesh, "vertex_source": ORDER} | fields)


AWKWARD_MESH = np.array([*AWKWARD_FLOATS, 0.0, -0.0, 0.0, 1.0, -2.0, -0.5], "<f4").reshape(5, 3)
NO_REFINED_REST = [(REFINED_REST, 3, 0), (REFINED_REST, 4, 0)]
HOSTED_STEMS = [Stem(-1, 70), Stem(0, 9, 60, SHEET), Stem(1, 4, 8)]
HOSTED_MESH = np.array(grown(HOSTED_STEMS, 6), "<f4")


def tall(*counts: int) -> Draft:
    """Return roots of so many vertices."""
    return without_mesh([Stem(-1, count, lag=1) for count in counts])


def deep() -> Draft:
    """Return a draft for a host's mesh with 1,300 branches, each hanging on the one before it, and four more that hang
    on earlier ones.
    """
    stems = chain(1300, 1, flags=0)
    for up in (1200, 1, 20, 98):
        parent = len(stems) - 1
        for _ in range(up):
            parent = stems[parent].parent
        stems.append(Stem(parent, 1))
    return without_mesh([replace(stem, flags=WHOLE if b == 0 else 0) for b, stem in enumerate(stems)])


def without_mesh(stems: list[Stem]) -> Draft:
    """Return a draft whose rest pose is a host's mesh that is not supplied, so that only its hierarchy can be
    decoded.
    """
    count = sum(stem.count for stem in stems)
    stream = write(rules.decode_hierarchy, hierarchy_script(stems), len(stems), count)
    plan = rules.make_parts(rules.decode_hierarchy(stream, len(stems), count)[0])
    levels, front = range(plan.height + 2), Plant([Stem(-1, 1)], mesh=np.zeros((1, 3), "<f4")).draft()
    return (
        replace(front, entries=front.entries[:3])
        .with_header(place_count=count, branch_count=len(stems), level_count=len(levels), full_level_count=len(levels))
        .change(HIERARCHY, content=stream)
        .add(*(Entry(STEMS, b"", level, 0) for level in levels if rules.has_stems(plan, level)))
        .add(*(Entry(AFFINES, b"", level, 0) for level in levels if rules.has_affines(plan, level, level)))
    )


valid("host-mesh: the rest pose is the host's mesh, in source order", hosted, mesh=MESH)
valid(
    "host-mesh-far: a mesh far from 0, less an origin",
    lambda: hosted(MESH * np.float32(1e5), origin=(2e5, -1e5, 0.1)),
    mesh=MESH * np.float32(1e5),
)
valid(
    "host-mesh-awkward: -0.0, which counts as 0.0, subnormal and largest numbers in the host's mesh",
    lambda: hosted(AWKWARD_MESH),
    mesh=AWKWARD_MESH,
)
valid("host-mesh-wide: binary64 positions about a mesh of binary32", lambda: hosted(is_float64=True), mesh=MESH)
valid(
    "host-mesh-layers: three layers about the host's mesh, which none refines",
    lambda: layered(3, *NO_REFINED_REST, mesh=MESH, vertex_source=ORDER),
    mesh=MESH,
)
valid(
    "host-mesh-sheets: sheets and long stems of the host's mesh",
    lambda: moving(HOSTED_STEMS, 71, frames=3, mesh=HOSTED_MESH, heads=HEADS),
    mesh=HOSTED_MESH,
)
invalid("host-mesh-none NEEDS_HOST_MESH 0: no mesh is given", hosted)
invalid("host-mesh-short: a mesh with one vertex less", hosted, "WRONG_HOST_MESH", 0, MESH[:-1])
invalid("host-mesh-long: a mesh with one vertex more", hosted, "WRONG_HOST_MESH", 0, np.append(MESH, MESH[:1], axis=0))
invalid("host-mesh-in-file-order: the mesh in file order", hosted, "WRONG_HOST_MESH", 0, MESH[ORDER])
for name, value in (("nan", NAN), ("infinite", -INFINITY)):
    INFINITE_MESH = np.append(MESH[:-1], [[0.0, np.float32(value), 0.0]], axis=0).astype("<f4")
    invalid(
        f"host-mesh-{name}: the file's own mesh has {value}",
        lambda mesh=INFINITE_MESH: hosted().change(REST, content=host_rest_chunk(mesh)),
        "WRONG_HOST_MESH",
        0,
        INFINITE_MESH,
    )
for at, word in ((17, "first"), (21, "second")):
    invalid(
        f"host-mesh-{word}-checksum: a mesh that differs by the {word} checksum alone",
        lambda at=at: hosted().change(REST, content=flipped(host_rest_chunk(MESH), at)),
        "WRONG_HOST_MESH",
        0,
        MESH,
    )
for name, why, bits in (("exact", "Is_Exact", {"exact": 1}), ("float64", "Rest_Is_Float64", {"rest_type": 1})):
    prelude(REST, f"host-{name}: {why} beside Is_Host in Method", lambda bits=bits: host_rest_chunk(MESH, **bits))
for name, why, change in (
    ("no-checksum", "Is_Host without checksums", lambda chunk: chunk[:17]),
    ("checksum-short", "Is_Host with 7 bytes of checksums", lambda chunk: chunk[:-1]),
    ("checksum-long", "Is_Host with a byte behind the checksums", lambda chunk: chunk + b"\0"),
):
    prelude(REST, f"host-{name}: {why}", lambda change=change: change(host_rest_chunk(MESH)))
prelude(
    REST, "step-of-host: Rest_Step is 0 with Is_Host, where it has no meaning", lambda: host_rest_chunk(MESH, step=0.0)
)
invalid(
    "refined-rest-of-host BAD_CHUNK 3: REFINED_REST of the host's mesh",
    lambda: layered(3, *NO_REFINED_REST, mesh=MESH, vertex_source=ORDER).add(
        Entry(REFINED_REST, refined_rest_chunk(b""), 3)
    ),
    mesh=MESH,
)
for title, make in {
    "host-mesh-tall NEEDS_HOST_MESH 0: of a stem of 2^17 vertices among short ones only 2^16 count for how many "
    "others have": lambda: tall(1 << 17, *range(1, 17)),
    "host-mesh-deep NEEDS_HOST_MESH 0: a chain of 1300 branches, from whose end others go up by 1200 and then by "
    "1 to 1000": deep,
}.items():
    invalid(title, make)
