"""What is written looks like a plant: it has colours, open faces are seen from both sides, normals follow the motion.
What is guessed for that does not come back as if the clip had said it."""

from __future__ import annotations

import json

import numpy as np
import pytest
from glb import COMPONENTS, TYPES, apart, together
from plants import turns

from athcodec.cli import main
from athcodec.exporters import write
from athcodec.exporters.surface import Surface
from athcodec.motion.clip import MotionClip

formats = pytest.mark.formats
BOX = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)])
CARD = np.array([[0, 0, 0], [0, 0, 1], [1, 0, 1], [1, 0, 0]], float)  # which faces up
QUAD = np.array([[0, 1, 2, 3]])
FRAMES = 5
ANGLES = np.linspace(0, 1.4, FRAMES)


def tube(sides: int, rings: int = 4, caps: bool = True, seam: bool = False, radius: float = 0.2):
    """Vertices and faces of a tube along y; its caps are polygons, its seam has vertices of both sides."""
    columns = sides + seam
    angle = 2 * np.pi * np.arange(columns) / sides
    ring = radius * np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    if seam:
        ring[-1] = ring[0]  # at one place to the last bit
    points = np.concatenate([ring + [0, height, 0] for height in range(rings)])
    corner = np.arange(rings - 1)[:, None] * columns + np.arange(sides)
    after = np.arange(rings - 1)[:, None] * columns + (np.arange(sides) + 1) % columns
    quads = np.stack([corner, after, after + columns, corner + columns], axis=-1).reshape(-1, 4).tolist()
    ends = [list(range(sides))[::-1], [(rings - 1) * columns + i for i in range(sides)]] if caps else []
    return points, quads + ends


def joined(*parts):
    """Vertices and faces of several meshes as one."""
    starts = np.cumsum([0] + [len(points) for points, _ in parts])
    faces = [[start + v for v in face] for start, (_, faces) in zip(starts.tolist(), parts) for face in faces]
    return np.concatenate([points for points, _ in parts]), faces


def polygons(faces):
    """Faces as a clip has those of different sizes."""
    return {
        "face_vertex_counts": np.array([len(face) for face in faces], np.int32),
        "face_vertex_indices": np.array([vertex for face in faces for vertex in face], np.int32),
    }


def surface(points, faces):
    arrays = polygons(faces)
    return Surface(arrays["face_vertex_counts"], arrays["face_vertex_indices"], points)


def clip_of(points, faces, attributes=None, angles=ANGLES, **metadata):
    """A mesh that turns about z."""
    frames = np.stack([points @ turns(np.array([0, 0, angle])).T for angle in angles]).astype(np.float32)
    every = polygons(faces) | (attributes or {})
    return MotionClip(frames, np.arange(len(frames)) / 30, attributes=every, metadata=metadata)


def shrub(**metadata):
    """A tube and a card beside it, one mesh."""
    return clip_of(*joined(tube(8), (CARD + [1, 1, 0], QUAD.tolist())), **metadata)


def parsed(path):
    return apart(path.read_bytes())


def array(parts, index):
    """An accessor as the text of glTF says, (count, width)."""
    gltf, behind = parts
    accessor = gltf["accessors"][index]
    view = gltf["bufferViews"][accessor["bufferView"]]
    dtype = np.dtype({number: name for name, number in COMPONENTS.items()}[accessor["componentType"]])
    width = {name: number for number, name in TYPES.items()}[accessor["type"]]
    start = 8 + view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
    strides = (view.get("byteStride", dtype.itemsize * width), dtype.itemsize)
    return np.ndarray((accessor["count"], width), dtype, behind, start, strides).copy()


def primitives(gltf):
    return [primitive for mesh in gltf["meshes"] for primitive in mesh["primitives"]]


def materials(gltf):
    """The material of each primitive."""
    return [gltf["materials"][primitive["material"]] for primitive in primitives(gltf)]


def colour(material):
    return material["pbrMetallicRoughness"]["baseColorFactor"][:3]


def is_green(material):
    red, green, blue = colour(material)
    return green > red > blue


# ---- in the first tier ----


def test_leaves_of_a_glb_are_green_lit_and_seen_from_behind_and_stems_are_not(tmp_path):
    write(shrub(), tmp_path / "a.glb", animation="joints")
    gltf, behind = parsed(tmp_path / "a.glb")
    stem, leaf = materials(gltf)
    assert "doubleSided" not in stem and leaf["doubleSided"] is True
    assert is_green(leaf) and not is_green(stem)
    for primitive, material in zip(primitives(gltf), (stem, leaf)):
        assert material["pbrMetallicRoughness"]["metallicFactor"] == 0
        assert material["pbrMetallicRoughness"]["roughnessFactor"] == 0.8
        normals = array((gltf, behind), primitive["attributes"]["NORMAL"])
        assert np.allclose(np.linalg.norm(normals, axis=1), 1)
        assert np.allclose(normals[-4:], [0, 1, 0])


# ---- which faces are open ----


@formats
@pytest.mark.parametrize(
    "mesh, is_open",
    {
        "a closed tube": (tube(6), False),
        "a tube that is open at both ends": (tube(6, caps=False), False),
        "a tube that was cut open for its texture": (tube(6, seam=True), False),
        "a card": ((CARD, QUAD.tolist()), True),
        "two cards back to back": ((np.tile(CARD, (2, 1)), [[0, 1, 2, 3], [7, 6, 5, 4]]), False),
        "a bent blade": ((np.array([[x, np.sin(y), np.cos(y)] for y in (0, 1, 2) for x in (0, 1)]),
                          [[0, 1, 3, 2], [2, 3, 5, 4]]), True),
        "three half cards around an edge": ((np.array(
            [[0, 0, 0], [0, 1, 0]] + [[np.sin(a), y, np.cos(a)] for a in (0, 2.1, 4.2) for y in (0, 1)]),
            [[0, 1, 3, 2], [0, 1, 5, 4], [0, 1, 7, 6]]), True),
        "a cup": (tube(8, rings=2, caps=False, radius=2.0), True),
        "a box of which one face looks inwards": ((BOX,
            [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]]), True),
        "a tube whose quads end in a point": ((np.concatenate([tube(6)[0][:12], [[0, 3, 0]]]),
            tube(6, rings=2, caps=False)[1] + [[6 + i, 6 + (i + 1) % 6, 12, 12] for i in range(6)]), False),
        "faces without area": ((np.zeros((4, 3)), QUAD.tolist()), True),
    }.values(),
)  # fmt: skip
def test_faces_that_enclose_nothing_are_open(mesh, is_open):
    assert (surface(*mesh).is_open == is_open).all()


@formats
def test_each_piece_of_a_mesh_is_open_or_not_by_itself():
    mesh = joined(tube(6), (CARD, QUAD.tolist()), tube(5, caps=False))
    expected = np.repeat([False, True, False], [len(tube(6)[1]), 1, len(tube(5, caps=False)[1])])
    assert np.array_equal(surface(*mesh).is_open, expected)


# ---- normals ----


@formats
@pytest.mark.parametrize("seam", [False, True])
def test_tubes_are_smooth_around_and_across_a_seam(seam):
    points, faces = tube(8, caps=False, seam=seam)
    expected = points * [5, 0, 5]
    assert np.allclose(surface(points, faces).normals(points), expected, atol=1e-12)


@formats
def test_a_box_whose_corners_are_apart_keeps_its_edges():
    side = CARD - 0.5 + [0, 1, 0]
    six = [
        np.zeros(3),
        *(np.pi / 2 * np.array(axis) for axis in ([1, 0, 0], [-1, 0, 0], [0, 0, 1], [0, 0, -1], [2, 0, 0])),
    ]
    points = np.round(np.concatenate([side @ turns(angle).T for angle in six]), 6)
    faces = [list(range(4 * i, 4 * i + 4)) for i in range(6)]
    up = np.repeat([turns(angle) @ [0, 1, 0] for angle in six], 4, axis=0)
    assert np.allclose(surface(points, faces).normals(points), up, atol=1e-6)
    assert not surface(points, faces).is_open.any()


def shown_normals(path, frame):
    """Normals in the world at a key of the first animation, by the text of glTF: of joints or of morph targets."""
    parts = gltf, _ = parsed(path)
    primitive = gltf["meshes"][0]["primitives"][0]
    normals = array(parts, primitive["attributes"]["NORMAL"]).astype(float)
    if "targets" in primitive:
        return normals + array(parts, primitive["targets"][frame]["NORMAL"])
    joints = array(parts, primitive["attributes"]["JOINTS_0"])[:, 0]
    skin, animation = gltf["skins"][0], gltf["animations"][0]
    bind = array(parts, skin["inverseBindMatrices"]).reshape(-1, 4, 4).swapaxes(1, 2)[:, :3, :3]
    rotations = {node: gltf["nodes"][node].get("rotation", [0, 0, 0, 1]) for node in skin["joints"]}
    for channel in animation["channels"]:
        if channel["target"]["path"] == "rotation":
            keys = array(parts, animation["samplers"][channel["sampler"]]["output"])
            rotations[channel["target"]["node"]] = keys[min(frame, len(keys) - 1)]
    matrices = []
    for node in skin["joints"]:
        axis, cosine = np.asarray(rotations[node][:3], float), rotations[node][3]
        sine = np.linalg.norm(axis)
        matrices.append(turns(2 * np.arctan2(sine, cosine) * axis / max(sine, 1e-12)))
    return np.einsum("nij,njk,nk->ni", np.array(matrices)[joints], bind[joints], normals)


@formats
@pytest.mark.parametrize("animation", ["joints", "morphs"])
@pytest.mark.parametrize("given", [False, True])
def test_normals_turn_with_the_motion(animation, given, tmp_path):
    points, faces = tube(8, caps=False)
    expected = points * [5, 0, 5]
    if given:  # slanted, as those of a cone
        expected = (expected + [0, 0.5, 0]) / np.sqrt(1.25)
    attributes = {"normals": expected.astype(np.float32)} if given else {}
    write(clip_of(points, faces, attributes), tmp_path / "a.glb", animation=animation)
    for frame, angle in enumerate(ANGLES):
        turned = expected @ turns(np.array([0, 0, angle])).T
        shown = shown_normals(tmp_path / "a.glb", frame)
        assert np.abs(shown - turned).max() < 1e-4
        assert np.abs(np.linalg.norm(shown, axis=1) - 1).max() < 1e-5


@formats
def test_auto_counts_the_bytes_of_normals_that_morph_targets_have(tmp_path):
    """Joints of the mesh are smaller than its targets, and would be larger than targets without normals."""
    rng = np.random.default_rng(0)
    cards = joined(*((CARD + [2 * i, 0, 0], QUAD.tolist()) for i in range(40)))
    angles = rng.normal(size=(40, 40, 3)) * 0.5
    rest = cards[0].reshape(40, 4, 3)
    frames = np.einsum("tkij,kmj->tkmi", turns(angles), rest).reshape(40, 160, 3).astype(np.float32)
    clip = MotionClip(
        frames,
        np.arange(40) / 30,
        rest=cards[0],
        attributes=polygons(cards[1]),
        vertex_branch=np.repeat(np.arange(40), 4),
        branch_parent=np.array([-1] + [0] * 39),
    )
    assert write(clip, tmp_path / "auto.glb").facts["animation"] == "joints"
    write(clip, tmp_path / "morphs.glb", animation="morphs")
    assert (tmp_path / "auto.glb").stat().st_size < (tmp_path / "morphs.glb").stat().st_size / 2


# ---- names and colours ----


@formats
def test_surfaces_of_the_metadata_become_materials_of_their_names_and_colours(tmp_path):
    clip = shrub(surfaces="bark, blades")
    uv = np.random.default_rng(0).random((clip.vertex_count, 2)).astype(np.float32)
    uv[0] = 1  # as the middle of a stem may have it
    uv[-4:, 0] += 1
    clip.attributes["uv"] = uv
    write(clip, tmp_path / "a.glb")
    found = materials(parsed(tmp_path / "a.glb")[0])
    assert [material["name"] for material in found] == ["bark", "blades"]
    assert [is_green(material) for material in found] == [False, True]
    assert ["doubleSided" in material for material in found] == [False, True]


@formats
@pytest.mark.parametrize(
    "name, is_of_a_leaf",
    [("OakLeaf.001", True), ("leaf_stem", False), ("Bark", False), ("flower_stalk_leaves", True), ("BRANCHES", False)],
)
def test_materials_keep_their_names_and_get_the_colour_that_these_mean(name, is_of_a_leaf, tmp_path):
    clip = clip_of(*tube(6))
    labels = {"face_material": np.zeros(len(tube(6)[1]), np.int32)}
    clip = clip.replace(attributes=clip.attributes | labels, metadata={"material_names": [name]})
    write(clip, tmp_path / "a.glb")
    (material,) = materials(parsed(tmp_path / "a.glb")[0])
    assert (material["name"], is_green(material)) == (name, is_of_a_leaf)


@formats
@pytest.mark.parametrize("name, colours", [("leafy_tree", 2), ("grass", 1)])
def test_a_name_of_an_object_that_is_of_a_part_says_its_colour_and_one_of_a_plant_does_not(name, colours, tmp_path):
    clip = shrub(part_names=[name], part_kinds=["mesh"])
    clip.attributes["part_vertex_counts"] = np.array([clip.vertex_count], np.int32)
    write(clip, tmp_path / "a.glb")
    assert len({tuple(colour(material)) for material in materials(parsed(tmp_path / "a.glb")[0])}) == colours


@formats
def test_colours_of_vertices_are_shown_as_they_are(tmp_path):
    clip = shrub()
    clip.attributes["colors"] = np.random.default_rng(0).random((clip.vertex_count, 3)).astype(np.float32)
    write(clip, tmp_path / "a.glb")
    parts = parsed(tmp_path / "a.glb")
    assert all(colour(material) == [1, 1, 1] for material in materials(parts[0]))
    stored = array(parts, primitives(parts[0])[0]["attributes"]["COLOR_0"])
    assert np.array_equal(stored, clip.attributes["colors"])


@formats
@pytest.mark.parametrize("edges", [None, np.array([[0, 1], [1, 2]], np.int32)])
def test_lines_and_points_have_a_colour_and_no_light(edges, tmp_path):
    frames = np.random.default_rng(0).random((3, 3, 3)).astype(np.float32)
    write(MotionClip(frames, np.arange(3) / 30, edges=edges), tmp_path / "a.glb", animation="morphs")
    gltf, _ = parsed(tmp_path / "a.glb")
    (material,), (primitive,) = materials(gltf), primitives(gltf)
    assert material["extensions"] == {"KHR_materials_unlit": {}} and gltf["extensionsUsed"] == ["KHR_materials_unlit"]
    assert max(colour(material)) < 1 and "NORMAL" not in primitive["attributes"]
    assert all(target.keys() == {"POSITION"} for target in primitive["targets"])


@formats
def test_instances_beside_points_state_what_both_use(tmp_path):
    rest = np.concatenate([*(CARD + [0, i, 0] for i in range(3)), np.ones((2, 3))])
    faces = [[4 * i + k for k in range(4)] for i in range(3)]
    clip = clip_of(rest, faces, angles=[0.0], part_names=["leaf", "dust"], part_kinds=["mesh", "points"])
    clip.attributes |= {"part_vertex_counts": np.int32([12, 2]), "part_copies": np.int32([3, 1])}
    write(clip, tmp_path / "a.glb", instances=True)
    gltf, _ = parsed(tmp_path / "a.glb")
    assert sorted(gltf["extensionsUsed"]) == ["EXT_mesh_gpu_instancing", "KHR_materials_unlit"]
    assert gltf["extensionsRequired"] == ["EXT_mesh_gpu_instancing"]


@formats
@pytest.mark.parametrize("suffix", [".glb", ".usda"])
@pytest.mark.parametrize("frames", [1, FRAMES])
def test_what_was_guessed_does_not_come_back(suffix, frames, tmp_path):
    from athcodec.sources import read

    clip = shrub()
    clip = clip.replace(positions=clip.block(0, frames), time=clip.time[:frames])
    write(clip, tmp_path / f"a{suffix}")
    with read(tmp_path / f"a{suffix}") as again:
        assert not {"face_material", "normals", "colors"} & again.attributes.keys()
        assert not {"material_names", "part_usd"} & again.metadata.keys()
        assert not again.not_read


@formats
@pytest.mark.parametrize("suffix", [".glb", ".usda"])
def test_what_the_clip_says_comes_back(suffix, tmp_path):
    from athcodec.sources import read

    clip = clip_of(*tube(6), part_names=["stem"], part_kinds=["mesh"], part_usd=[{"doubleSided": "true"}])
    clip.attributes["part_vertex_counts"] = np.array([clip.vertex_count], np.int32)
    clip.attributes["face_material"] = np.arange(len(tube(6)[1]), dtype=np.int32) % 2
    clip.metadata["material_names"] = ["leaf", "wet bark"]
    write(clip, tmp_path / f"a{suffix}")
    with read(tmp_path / f"a{suffix}") as again:
        assert again.metadata["material_names"] == ["leaf", "wet bark"]
        assert again.metadata["part_usd"] == [{"doubleSided": "true"}]
        assert sorted(np.unique(again.attributes["face_material"])) == [0, 1]


@formats
def test_copies_show_what_their_shape_does_and_their_normals_are_those_of_the_shape(tmp_path):
    rest = np.concatenate([CARD + [0, i, 0] for i in range(3)])
    clip = clip_of(rest, [[4 * i + k for k in range(4)] for i in range(3)], part_names=["leaf"], part_kinds=["mesh"])
    clip.attributes |= {"part_vertex_counts": np.array([12], np.int32), "part_copies": np.array([3], np.int32)}
    write(clip, tmp_path / "a.glb", instances=True)
    parts = gltf, _ = parsed(tmp_path / "a.glb")
    (material,), (primitive,) = materials(gltf), primitives(gltf)
    assert material["doubleSided"] and is_green(material)
    points, normals = (array(parts, primitive["attributes"][key]) for key in ("POSITION", "NORMAL"))
    across = np.cross(points[1] - points[0], points[2] - points[0])
    assert np.allclose(normals, across / np.linalg.norm(across), atol=1e-6)


# ---- into a GLB, and out of it ----


def bare(path, clip, change=lambda gltf: None, **options):
    """A file that moves and has neither materials nor normals."""
    write(clip, path, **options)
    gltf, behind = parsed(path)
    gltf.pop("materials")
    for primitive in primitives(gltf):
        primitive.pop("material", None)
        primitive["attributes"].pop("NORMAL", None)
        for target in primitive.get("targets", ()):
            target.pop("NORMAL", None)
    change(gltf)
    path.write_bytes(together(json.dumps(gltf).encode(), behind))
    return path


def with_motion(source, out, *options):
    assert main(["encode", str(source), "--into", str(out), "--rel-error", "1e-4", *options]) == 0
    return parsed(out)


@formats
def test_a_glb_without_materials_gets_some_with_its_motion(tmp_path):
    labels = {"face_material": np.zeros(len(joined(tube(8), (CARD, QUAD.tolist()))[1]), np.int32)}
    clip = shrub(material_names=["all"])
    clip.attributes |= labels  # so that it is a single primitive
    parts = gltf, _ = with_motion(bare(tmp_path / "a.glb", clip, animation="joints"), tmp_path / "b.glb")
    stem, leaf = materials(gltf)
    assert is_green(leaf) and leaf["doubleSided"] and not is_green(stem) and "doubleSided" not in stem
    one, other = primitives(gltf)
    assert one["attributes"] == other["attributes"] and one["extensions"] == other["extensions"]
    assert np.allclose(array(parts, one["attributes"]["NORMAL"])[-4:], [0, 1, 0])
    assert len(array(parts, one["indices"])) + len(array(parts, other["indices"])) == 3 * (8 * 3 * 2 + 2 * 6 + 2)
    assert main(["verify", str(tmp_path / "b.glb"), "--against", str(tmp_path / "a.glb")]) == 0


@formats
def test_every_primitive_of_a_mesh_keeps_its_triangles_where_it_becomes_two(tmp_path):
    plant = joined(tube(8), (CARD + [1, 1, 0], QUAD.tolist()))
    both = joined(plant, (plant[0] + [3, 0, 0], plant[1]))
    clip = clip_of(*both, part_names=["a", "b"], part_kinds=["mesh", "mesh"], material_names=["all"])
    clip.attributes |= {"part_vertex_counts": np.int32([len(plant[0])] * 2)}
    clip.attributes |= {"face_material": np.zeros(len(both[1]), np.int32)}

    def merge(gltf):
        """One mesh, whose primitives have vertices of their own."""
        node = next(node for node in gltf["nodes"] if node.get("mesh") == 1)
        del node["mesh"], node["skin"]
        gltf["meshes"][0]["primitives"] += gltf["meshes"].pop()["primitives"]

    def triangles(parts):
        """Of all primitives, as places of corners."""
        found = []
        for primitive in primitives(parts[0]):
            points = array(parts, primitive["attributes"]["POSITION"])
            found.append(points[array(parts, primitive["indices"])[:, 0]].reshape(-1, 9))
        return np.unique(np.concatenate(found), axis=0)

    source = bare(tmp_path / "a.glb", clip, merge, animation="joints")
    parts = with_motion(source, tmp_path / "b.glb")
    assert [is_green(material) for material in materials(parts[0])] == [False, False, True, True]
    assert np.array_equal(triangles(parts), triangles(parsed(source)))


@formats
def test_materials_of_a_glb_stay_as_they_are_and_what_has_one_gets_no_normals(tmp_path):
    glass = {"name": "glass", "pbrMetallicRoughness": {"metallicFactor": 1.0}}

    def dress(gltf):
        gltf["materials"] = [glass]
        primitives(gltf)[1]["material"] = 0

    clip = shrub(part_names=["trunk", "leaf"], part_kinds=["mesh", "mesh"])
    clip.attributes["part_vertex_counts"] = np.array([clip.vertex_count - 4, 4], np.int32)
    gltf, _ = with_motion(bare(tmp_path / "a.glb", clip, dress, animation="joints"), tmp_path / "b.glb")
    assert gltf["materials"][0] == glass
    one, other = primitives(gltf)
    assert other["material"] == 0 and "NORMAL" not in other["attributes"]
    assert materials(gltf)[0]["name"] == "stems" and "NORMAL" in one["attributes"]


@formats
def test_normals_of_a_glb_with_motion_become_those_of_morph_targets(tmp_path):
    points, faces = tube(8, caps=False)
    write(clip_of(points, faces), tmp_path / "a.glb", animation="joints")
    with_motion(tmp_path / "a.glb", tmp_path / "b.glb")
    assert main(["decode", str(tmp_path / "b.glb"), str(tmp_path / "c.glb")]) == 0
    for frame, angle in enumerate(ANGLES):
        turned = points * [5, 0, 5] @ turns(np.array([0, 0, angle])).T
        assert np.abs(shown_normals(tmp_path / "c.glb", frame) - turned).max() < 1e-3


@formats
def test_an_animation_that_is_kept_is_shown_in_the_light_that_it_had(tmp_path):
    """Normals without those of its morph targets would not move."""
    source = bare(tmp_path / "a.glb", shrub(), animation="morphs")
    gltf, _ = with_motion(source, tmp_path / "b.glb", "--keep-animation")
    assert all("NORMAL" not in primitive["attributes"] and primitive["targets"] for primitive in primitives(gltf))
    assert len(materials(gltf)) == len(primitives(gltf))


# ---- USD ----


@formats
def test_usd_has_a_colour_for_each_face_and_both_sides_of_open_ones(tmp_path):
    from pxr import Usd, UsdGeom

    both = joined(tube(8), *(tube(5), (CARD + [1, 1, 0], QUAD.tolist())))
    both = np.concatenate([both[0], np.ones((2, 3))]), both[1]
    clip = clip_of(*both, part_names=["trunk", "shoot", "line"], part_kinds=["mesh", "mesh", "points"])
    clip.attributes["part_vertex_counts"] = np.array([len(tube(8)[0]), len(tube(5)[0]) + 4, 2], np.int32)
    write(clip, tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    trunk, shoot, line = (UsdGeom.Gprim(stage.GetPrimAtPath(f"/clip/{name}")) for name in ("trunk", "shoot", "line"))
    assert not trunk.GetDoubleSidedAttr().Get() and shoot.GetDoubleSidedAttr().Get()
    assert UsdGeom.Mesh(shoot).GetSubdivisionSchemeAttr().Get() == "none"
    (brown,) = trunk.GetDisplayColorPrimvar().ComputeFlattened()
    assert (
        trunk.GetDisplayColorPrimvar().GetInterpolation()
        == line.GetDisplayColorPrimvar().GetInterpolation()
        == "constant"
    )
    faces = np.array(shoot.GetDisplayColorPrimvar().ComputeFlattened())
    assert shoot.GetDisplayColorPrimvar().GetInterpolation() == "uniform" and len(faces) == len(tube(5)[1]) + 1
    assert np.allclose(faces[:-1], brown) and faces[-1, 1] > faces[-1, 0] > faces[-1, 2]
    assert not UsdGeom.Mesh(shoot).GetNormalsAttr().HasAuthoredValue()


@formats
def test_usd_keeps_the_colours_of_vertices(tmp_path):
    from pxr import Usd, UsdGeom

    clip = shrub()
    clip.attributes["colors"] = np.random.default_rng(0).random((clip.vertex_count, 3)).astype(np.float32)
    write(clip, tmp_path / "a.usda")
    stage = Usd.Stage.Open(str(tmp_path / "a.usda"))
    mesh = UsdGeom.Mesh(stage.GetPrimAtPath("/clip/plant"))
    assert np.allclose(mesh.GetDisplayColorPrimvar().Get(), clip.attributes["colors"], atol=1e-6)


@formats
def test_meshes_of_a_rig_and_shapes_of_instances_have_normals_in_usd(tmp_path):
    from pxr import Usd, UsdGeom

    points, faces = tube(8, caps=False)
    rest, quads = joined((points, faces), *((CARD + [0, i, 0], QUAD.tolist()) for i in range(3)))
    clip = clip_of(rest, quads, part_names=["stem", "leaf"], part_kinds=["mesh", "mesh"])
    clip.attributes |= {"part_vertex_counts": np.array([len(points), 12], np.int32), "part_copies": np.int32([1, 3])}
    write(clip, tmp_path / "a.usda", rig=4)
    write(clip, tmp_path / "b.usda", instances=True)
    stages = [Usd.Stage.Open(str(tmp_path / name)) for name in ("a.usda", "b.usda")]
    stem = UsdGeom.Mesh(stages[0].GetPrimAtPath("/clip/stem"))
    assert np.allclose(stem.GetNormalsAttr().Get(), points * [5, 0, 5], atol=1e-6)
    leaf = UsdGeom.Mesh(stages[1].GetPrimAtPath("/clip/leaf/leaf"))
    shape, normals = np.array(leaf.GetPointsAttr().Get()), np.array(leaf.GetNormalsAttr().Get())
    across = np.cross(shape[1] - shape[0], shape[2] - shape[0])
    assert leaf.GetNormalsInterpolation() == "vertex" and leaf.GetDoubleSidedAttr().Get()
    assert np.allclose(normals, across / np.linalg.norm(across), atol=1e-6)
