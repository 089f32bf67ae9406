"""ATH_motion: a GLB whose vertices move by an .ath file inside it shows, in the world, what it showed before, within
the bound; what does not move keeps its bytes; and a file that lies about its vertices is refused."""

from __future__ import annotations

import json
from contextlib import closing
from pathlib import Path

import jsonschema
import numpy as np
import pygltflib
import pytest
from glb import apart, together
from plants import distance
from referencing import Registry, Resource
from test_gltf import CUBE, Maker, about, leafy, seasons  # noqa: F401, fixtures

import athcodec
from athcodec.cli import main
from athcodec.errors import AthError, ClipError, WrongHostMesh
from athcodec.exporters import write
from athcodec.files.gltf.document import GltfFile
from athcodec.sources import read
from athcodec.sources.gltf_scene import Scene

pytestmark = pytest.mark.formats

SCHEMAS = Path(__file__).resolve().parent.parent / "spec" / "gltf" / "schema"
BOUND = 1e-4


def structure(path):
    return apart(Path(path).read_bytes())[0]


def rewritten(path, out, change):
    """The file with another structure: change(json)."""
    gltf, behind = apart(Path(path).read_bytes())
    change(gltf)
    Path(out).write_bytes(together(json.dumps(gltf).encode(), behind))
    return out


def encoded(source, out, *options):
    assert main(["encode", str(source), "--into", str(out), "--rel-error", str(BOUND), *options]) == 0
    check_schemas(structure(out))
    return out


def check_schemas(gltf):
    """Every object of the extension is as its JSON schema says."""
    schemas = [json.loads(path.read_text()) for path in SCHEMAS.glob("*.json")]
    registry = Registry().with_resources((one["$id"], Resource.from_contents(one)) for one in schemas)

    def check(name, value):
        schema = {"$ref": f"{name}.ATH_motion.schema.json"}
        jsonschema.Draft202012Validator(schema, registry=registry).validate(value)

    check("glTF", gltf["extensions"]["ATH_motion"])
    for primitive in moved_primitives(gltf):
        check("mesh.primitive", primitive["extensions"]["ATH_motion"])


def moved_primitives(gltf):
    every = [primitive for mesh in gltf["meshes"] for primitive in mesh["primitives"]]
    return [primitive for primitive in every if "ATH_motion" in primitive.get("extensions", {})]


def world(path, clip=None):
    """(T, N, 3): what moves, by the text of the extension, in the order of the nodes; and the bound there."""
    with closing(GltfFile(path)) as file, athcodec.open(path, clip=clip) as decoder:
        scene, found, largest = Scene(file), [], 0.0
        positions = decoder.positions(slice(0, decoder.frame_count)).astype(np.float64)
        for index in scene.order:
            mesh = scene.nodes[index].get("mesh")
            for primitive in moved_primitives({"meshes": [file.json["meshes"][mesh]]}) if mesh is not None else ():
                attributes = primitive["attributes"]
                vertices = np.arange(file.count(attributes["POSITION"]))
                vertices += primitive["extensions"]["ATH_motion"].get("firstVertex", 0)
                if "_ATH_VERTEX" in attributes:
                    vertices = file.array(attributes["_ATH_VERTEX"])[:, 0].astype(int)
                matrix = scene.matrices(scene.ancestors({index}), None)[index][0]
                found.append(positions[:, vertices] @ matrix[:3, :3].T + matrix[:3, 3])
                largest = max(largest, np.linalg.norm(matrix[:3, :3], 2))
        return np.concatenate(found, axis=1), decoder.file.max_error_bound * largest


def assert_same_motion(source, out, clip=None, **options):
    moved, bound = world(out, clip)
    with read(source, **options) as wanted:
        frames = wanted.block(0, wanted.frame_count)
    assert moved.shape == frames.shape
    assert distance(moved, frames) <= bound + 1e-6 * np.abs(frames).max()


def seamed(clip, path, **node):
    """Faces with seams: corners of faces are vertices of their own, with texture coordinates of theirs; by morphs."""
    corners = clip.faces.ravel()
    made = Maker()
    rest = clip.rest[corners].astype(np.float32)
    frames = clip.block(0, clip.frame_count)[:, corners]
    targets = [{"POSITION": made.array((frame - rest).astype(np.float32))} for frame in frames]
    uv = np.random.default_rng(0).random((len(corners), 2), np.float32)
    weights = np.eye(len(frames))
    mesh = made.mesh(
        {"POSITION": made.array(rest), "TEXCOORD_0": made.array(uv)},
        "strip",
        targets=targets,
        weights=[0] * len(frames),
    )
    index = made.node(mesh=mesh, name="strip", **node)
    made.animation([(index, "weights", 0.25 + np.arange(len(frames)) / 30, weights, "LINEAR")], "breeze")
    for accessor, values in zip(made.gltf.accessors, [*(frame - rest for frame in frames), rest]):
        accessor.min, accessor.max = values.min(axis=0).tolist(), values.max(axis=0).tolist()
    return made.save(path)


@pytest.fixture(params=["joints", "morphs"])
def source(request, leafy, tmp_path):  # noqa: F811
    write(leafy, tmp_path / "source.glb", animation=request.param)
    return tmp_path / "source.glb"


def test_what_moved_moves_as_before_and_nothing_else_is_left_of_it(source, tmp_path):
    out = encoded(source, tmp_path / "out.glb")
    assert_same_motion(source, out)
    gltf, before = structure(out), structure(source)
    assert not {"animations", "skins"} & gltf.keys() and all("targets" not in one for one in moved_primitives(gltf))
    assert all(len(gltf[kind]) < len(before[kind]) for kind in ("accessors", "bufferViews"))
    assert "ATH_motion" in gltf["extensionsUsed"] and "extensionsRequired" not in gltf
    assert out.stat().st_size < source.stat().st_size / 4


@pytest.fixture
def leafy_out(leafy, tmp_path):  # noqa: F811
    write(leafy, tmp_path / "source.glb")
    return encoded(tmp_path / "source.glb", tmp_path / "out.glb")


def stored_positions(path):
    with closing(GltfFile(path)) as file:
        return file.array(file.json["meshes"][0]["primitives"][0]["attributes"]["POSITION"])


@pytest.mark.parametrize("up, unit", [("z", "cm"), ("y", "m"), ("x", "mm")])
def test_units_and_axes_stay_those_of_the_file(up, unit, leafy, tmp_path):  # noqa: F811
    turned = leafy.replace(metadata=leafy.metadata | {"unit": unit, "up_axis": up})
    for animation in ("joints", "morphs"):
        write(turned, tmp_path / "source.glb", animation=animation)
        out = encoded(tmp_path / "source.glb", tmp_path / "out.glb")
        assert_same_motion(tmp_path / "source.glb", out)
        first, second = stored_positions(tmp_path / "source.glb"), stored_positions(out)
        assert np.array_equal(first, second), "the numbers of the mesh are its own"


def test_the_mesh_is_not_stored_twice(leafy_out):
    with athcodec.open(leafy_out) as decoder:
        assert decoder.file.host_checksum is not None and decoder.file.info()["rest_bytes"] < 40


def test_vertices_on_both_sides_of_a_seam_are_coded_once(leafy, tmp_path):  # noqa: F811
    source = seamed(leafy, tmp_path / "source.glb", translation=[1, 2, 3], scale=[2, 2, 2])
    out = encoded(source, tmp_path / "out.glb")
    assert_same_motion(source, out)
    with athcodec.open(out) as decoder:
        assert decoder.file.vertex_count == len(np.unique(leafy.faces)) < leafy.faces.size
        assert decoder.file.clips[0].name == "breeze"
        assert decoder.file.faces.shape == leafy.faces.shape
    assert main(["verify", str(out), "--against", str(source)]) == 0


def test_the_animation_may_stay_for_programs_that_do_not_know_the_extension(source, tmp_path):
    out = encoded(source, tmp_path / "out.glb", "--keep-animation")
    moved, _ = world(out)
    kept = rewritten(out, tmp_path / "kept.glb", lambda gltf: gltf.pop("extensions"))
    with read(kept) as fallback, read(source) as wanted:
        assert np.array_equal(fallback.block(0, 40), wanted.block(0, 40))
        assert distance(moved, wanted.block(0, 40)) < 0.01


def test_nodes_that_move_and_others_that_share_their_mesh(tmp_path):
    made = Maker()
    normals = made.array(np.eye(3, dtype=np.float32)[np.arange(8) % 3])
    mesh = made.mesh({"POSITION": made.array(CUBE), "NORMAL": normals}, "cube", [0, 1, 2, 3, 4, 5])
    above = made.node(name="above", scale=[1, 2, 1])
    one, two = (made.node(above, mesh=mesh, name=name, translation=[0, 0, z]) for name, z in (("one", 1), ("two", 4)))
    still = made.node(mesh=mesh, name="still", translation=[9, 9, 9])
    camera = made.node(above, name="eye", extras={"keep": True})
    times = np.arange(12) / 24
    turn = [about([0, 1, 0.2], 0.2 * i)[0] for i in range(12)]
    made.animation(
        [
            (one, "rotation", times, turn, "LINEAR"),
            (two, "translation", times, np.sin(np.outer(times, [1, 2, 3])) + [0, 0, 4], "LINEAR"),
            (camera, "translation", times, np.outer(times, [1, 1, 1]), "LINEAR"),
        ],
        "spin",
    )
    source = made.save(tmp_path / "source.glb")
    out = encoded(source, tmp_path / "out.glb")
    assert_same_motion(source, out, only=["one", "two"])
    gltf = structure(out)
    named = {node.get("name"): node for node in gltf["nodes"]}
    assert named["still"] == structure(source)["nodes"][still]
    assert "extensions" not in gltf["meshes"][named["still"]["mesh"]]["primitives"][0]
    assert [channel["target"]["path"] for channel in gltf["animations"][0]["channels"]] == ["translation"]
    assert gltf["nodes"][gltf["animations"][0]["channels"][0]["target"]["node"]]["name"] == "eye"
    with closing(GltfFile(out)) as file:
        for primitive in moved_primitives(gltf):
            assert np.linalg.norm(file.array(primitive["attributes"]["NORMAL"]), axis=1) == pytest.approx(1)


def armature(path, **transform):
    """A skin as modelling programs write it: mesh and joints below one node that scales and turns."""
    made = Maker()
    rng = np.random.default_rng(1)
    points = np.concatenate([CUBE + [0, 2 * k, 0] for k in range(12)]).astype(np.float32)
    joints = np.zeros((len(points), 4), np.uint8)
    joints[:, 0] = np.minimum(points[:, 1] // 8, 2)
    weights = np.tile(np.float32([1, 0, 0, 0]), (len(points), 1))
    faces = rng.integers(0, len(points), 60)
    mesh = made.mesh(
        {"POSITION": made.array(points), "JOINTS_0": made.array(joints), "WEIGHTS_0": made.array(weights)},
        "trunk",
        faces,
    )
    above = made.node(name="armature", **transform)
    chain, bind = [], []
    for k in range(3):
        chain.append(made.node(chain[-1] if chain else above, name=f"bone {k}", translation=[0, 8.0 if k else 0, 0]))
        bind.append(np.eye(4))
        bind[-1][1, 3] = -8.0 * k
    matrices = made.array(np.stack(bind).swapaxes(1, 2).reshape(-1, 16).astype(np.float32))
    made.gltf.skins.append(pygltflib.Skin(joints=chain, inverseBindMatrices=matrices))
    made.node(above, mesh=mesh, skin=0, name="trunk")
    made.node(chain[2], mesh=made.mesh({"POSITION": made.array(CUBE)}, "lamp"), name="lamp")
    times = np.arange(24) / 24
    made.animation(
        [
            (bone, "rotation", times, [about([0.2 * k, 0, 1], 0.1 * np.sin(6 * t + k))[0] for t in times], "LINEAR")
            for k, bone in enumerate(chain)
        ],
        "sway",
    )
    return made.save(path)


def test_a_mesh_below_an_armature_stays_there_and_what_hangs_on_its_bones_moves_too(tmp_path):
    turn = about([1, 0, 0], -np.pi / 2)[0]
    source = armature(tmp_path / "source.glb", scale=[0.01] * 3, rotation=turn, translation=[1, 2, 3])
    out = encoded(source, tmp_path / "out.glb")
    assert main(["verify", str(out), "--against", str(source)]) == 0
    (moved, bound), lamp = world(out), 8
    with read(source) as clip:
        frames = np.roll(clip.block(0, clip.frame_count), -lamp, axis=1)  # whose node stands last now
    assert distance(moved, frames) <= bound + 1e-6 * np.abs(frames).max()
    assert np.array_equal(stored_positions(source), stored_positions(out))
    named = {node["name"]: node for node in structure(out)["nodes"]}
    assert named["trunk"].keys() == {"mesh", "name"} and "armature" in named
    assert named["lamp"].keys() == {"mesh", "name", "matrix"} and "bone 0" not in named
    only = encoded(source, tmp_path / "only.glb", "--only", "trunk")
    assert_same_motion(source, only, only=["trunk"])
    gltf = structure(only)
    assert len(gltf["animations"][0]["channels"]) == 3, "the lamp goes on hanging on its bone"
    kept = encoded(source, tmp_path / "kept.glb", "--only", "trunk", "--keep-animation")
    assert_same_motion(source, kept, only=["trunk"])


def test_animations_become_clips_of_their_names_rates_loops_and_starts(seasons, tmp_path):  # noqa: F811
    write(athcodec.join(seasons), tmp_path / "source.glb", animation="morphs")
    out = encoded(tmp_path / "source.glb", tmp_path / "out.glb")
    with athcodec.open(out) as decoder:
        assert [clip.name for clip in decoder.file.clips] == list(seasons)
        assert [clip.loop for clip in decoder.file.clips] == [True, False, False, False]
    for name in seasons:
        assert_same_motion(tmp_path / "source.glb", out, name, takes=[name])
    said = {clip["name"]: clip for clip in structure(out)["extensions"]["ATH_motion"]["motions"][0]["clips"]}
    assert said["gale"]["extras"]["start_frame"] == 100 and "start" not in said["gale"]


def test_a_clip_begins_with_the_first_key_of_its_animation(leafy, tmp_path):  # noqa: F811
    out = encoded(seamed(leafy, tmp_path / "source.glb"), tmp_path / "out.glb")
    clips = structure(out)["extensions"]["ATH_motion"]["motions"][0]["clips"]
    assert clips == [{"name": "breeze", "start": 0.25}]


def test_bytes_of_what_does_not_move_stay(source, tmp_path):
    def views(path):
        with closing(GltfFile(path)) as file:
            data = file.binary_chunk()
            places = [(view.get("byteOffset", 0), view["byteLength"]) for view in file.json["bufferViews"]]
            return [data[start : start + size] for start, size in places]

    before, after = views(source), views(encoded(source, tmp_path / "out.glb"))
    assert all(one in before for one in after[:-1]) and after[-1].startswith(b"\x89ATH")
    kept = ("asset", "scene", "materials")
    first, second = structure(source), structure(tmp_path / "out.glb")
    assert [first.get(key) for key in kept] == [second.get(key) for key in kept]


def test_a_file_of_extensions_that_are_not_known_keeps_every_number(source, tmp_path):
    def use(gltf):
        gltf["extensionsUsed"] = ["VENDOR_unknown"]
        gltf["extensions"] = {"VENDOR_unknown": {"accessor": len(gltf["accessors"]) - 1}}

    unknown = rewritten(source, tmp_path / "unknown.glb", use)
    out = encoded(unknown, tmp_path / "out.glb")
    before, after = structure(unknown), structure(out)
    for kind in ("accessors", "bufferViews", "nodes"):
        assert [{**one, "extensions": 0} for one in after[kind][: len(before[kind])]] == [
            {**one, "extensions": 0} for one in before[kind]
        ] or kind == "nodes"
    assert_same_motion(unknown, out)


def test_decode_verify_and_info_take_the_glb_itself(source, tmp_path, capsys):
    out = encoded(source, tmp_path / "out.glb")
    capsys.readouterr()
    assert main(["info", str(out), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["vertices"] == 63
    assert main(["verify", str(out)]) == 0
    assert main(["verify", str(out), "--against", str(source)]) == 0
    for name in ("again.npz", "again.glb"):
        assert main(["decode", str(out), str(tmp_path / name)]) == 0
        with read(source) as one, read(tmp_path / name) as two:
            assert np.array_equal(one.faces, two.faces)
            size = np.linalg.norm(np.ptp(one.block(0, one.frame_count).reshape(-1, 3), axis=0))
            assert distance(one.block(0, 40), two.block(0, 40)) <= 3 * BOUND * size


@pytest.fixture
def stand(tmp_path):
    """Two plants with bones of their own, of which a motion moves each."""
    made = Maker()
    for number, name in enumerate(("oak", "beech")):
        bone = made.node(name=f"{name} bone")
        top = made.node(name=name, children=[bone], translation=[3.0 * number, 0, 0])
        shape = {
            "POSITION": made.array(CUBE * (1 + number)),
            "JOINTS_0": made.array(np.zeros((8, 4), np.uint8)),
            "WEIGHTS_0": made.array(np.tile(np.array([1, 0, 0, 0], np.float32), (8, 1))),
        }
        made.node(mesh=made.mesh(shape, name, indices=[0, 1, 2, 1, 3, 2]), skin=number, name=f"{name} mesh")
        made.gltf.skins.append(pygltflib.Skin(joints=[bone]))
        turns = [about([0, 0, 1], 0.3 * np.sin(f) * (1 + number))[0] for f in range(12)]
        made.animation([(bone, "rotation", np.arange(12) / 30, turns, "LINEAR")], f"{name} sways")
        made.gltf.scenes[0].nodes = [node for node in made.gltf.scenes[0].nodes if node not in (bone,)]
        assert top in made.gltf.scenes[0].nodes
    made.save(tmp_path / "stand.glb")
    encoded(tmp_path / "stand.glb", tmp_path / "one.glb", "--only", "oak*", "--gltf-motion", "oak")
    return encoded(tmp_path / "one.glb", tmp_path / "two.glb", "--gltf-motion", "beech")


def test_a_glb_with_several_motions_is_opened_by_name(stand, tmp_path, capsys):
    source = tmp_path / "stand.glb"
    assert [motion["name"] for motion in structure(stand)["extensions"]["ATH_motion"]["motions"]] == ["oak", "beech"]
    for name in ("oak", "beech"):
        with read(source, only=[f"{name}*"]) as wanted, athcodec.open(stand, gltf_motion=name) as decoder:
            shown = decoder.positions(slice(0, 12)) + (wanted.rest - decoder.file.rest)
            assert decoder.file.vertex_count == 8 and len(decoder.file.faces) == 2
            assert distance(shown, wanted.block(0, 12)) <= decoder.file.max_error_bound + 1e-5
    for choice, said in ((None, "oak.*beech"), ("elm", "oak.*beech")):
        with pytest.raises(ClipError, match=said):
            athcodec.open(stand, gltf_motion=choice)
    capsys.readouterr()
    assert main(["info", str(stand), "--json"]) == 0
    found = json.loads(capsys.readouterr().out)["motions"]
    assert [each["file"].rpartition(", ")[2] for each in found] == ["oak", "beech"]
    assert main(["verify", str(stand)]) == 0
    assert main(["verify", str(stand), "--gltf-motion", "oak", "--against", str(source), "--only", "oak*"]) == 0
    assert main(["decode", str(stand), str(tmp_path / "a.npz")]) == 1
    assert main(["decode", str(stand), str(tmp_path / "a.npz"), "--gltf-motion", "beech"]) == 0


def test_motions_of_a_glb_are_written_back_and_cut_each_or_all(stand, tmp_path):
    assert main(["decode", str(stand), str(tmp_path / "all.glb")]) == 0
    assert main(["decode", str(stand), str(tmp_path / "oak.glb"), "--gltf-motion", "oak"]) == 0
    with read(tmp_path / "stand.glb", takes="all") as wanted, read(tmp_path / "all.glb", takes="all") as shown:
        assert [each.name for each in shown.clip_ranges] == ["oak sways", "beech sways"]
        assert distance(shown.block(0, 24), wanted.block(0, 24)) <= 3 * BOUND * 4
    assert "ATH_motion" not in structure(tmp_path / "all.glb").get("extensionsUsed", [])
    left = structure(tmp_path / "oak.glb")
    check_schemas(left)
    assert [motion["name"] for motion in left["extensions"]["ATH_motion"]["motions"]] == ["beech"]
    with athcodec.open(tmp_path / "oak.glb") as decoder, athcodec.open(stand, gltf_motion="beech") as before:
        assert np.array_equal(decoder.positions(5), before.positions(5))
    cut = tmp_path / "cut.glb"
    assert main(["truncate", str(stand), str(cut), "--level", "0", "--gltf-motion", "oak"]) == 0
    with athcodec.open(cut, gltf_motion="oak") as oak, athcodec.open(cut, gltf_motion="beech") as beech:
        assert oak.file.level_count == 1 < beech.file.level_count


def test_a_motion_takes_no_name_that_the_glb_has(stand, tmp_path, capsys):
    assert main(["encode", str(stand), "--into", str(tmp_path / "x.glb"), "--gltf-motion", "oak"]) == 1
    assert "oak" in capsys.readouterr().err


def test_truncate_takes_a_glb_and_writes_one_or_the_file_alone(source, tmp_path):
    whole, cut, alone = encoded(source, tmp_path / "out.glb"), tmp_path / "cut.glb", tmp_path / "cut.ath"
    for out in (cut, alone):
        assert main(["truncate", str(whole), str(out), "--level", "1"]) == 0
    check_schemas(structure(cut))
    assert structure(cut)["meshes"] == structure(whole)["meshes"] and cut.stat().st_size < whole.stat().st_size
    with (
        athcodec.open(whole) as long,
        athcodec.open(cut) as short,
        athcodec.open(alone, host_mesh=short.file.rest) as bare,
    ):
        assert short.file.level_count == bare.file.level_count == 2 < long.file.level_count
        for frame in (0, 17, 39):
            assert np.array_equal(short.positions(frame), long.positions(frame, 1))
            assert np.array_equal(bare.positions(frame), long.positions(frame, 1))


def test_a_glb_comes_from_a_glb_only(source, tmp_path, sample_ath, capsys):
    assert main(["truncate", str(sample_ath), str(tmp_path / "cut.glb"), "--level", "1"]) == 1
    assert capsys.readouterr().err.count("\n") == 1 and not list(tmp_path.glob("cut*"))


@pytest.mark.parametrize("keep", [[], ["--keep-animation"]])
def test_a_glb_is_decoded_into_a_glb_that_has_all_it_had(keep, source, tmp_path):
    def dress(gltf):
        gltf["materials"] = [{"name": "bark", "pbrMetallicRoughness": {"roughnessFactor": 0.25}}]
        gltf["meshes"][0]["primitives"][0]["material"] = 0

    dressed = rewritten(source, tmp_path / "dressed.glb", dress)
    out = encoded(dressed, tmp_path / "out.glb", *keep)
    assert main(["decode", str(out), str(tmp_path / "again.glb"), "--frames", "5:35"]) == 0
    gltf = structure(tmp_path / "again.glb")
    assert gltf["materials"] == structure(dressed)["materials"]
    assert gltf["meshes"][0]["primitives"][0]["material"] == 0
    assert not {"extensions", "extensionsUsed", "skins"} & gltf.keys() and len(gltf["animations"]) == 1
    moved, _ = world(out)
    with read(tmp_path / "again.glb") as again:
        assert distance(again.block(0, 30), moved[5:35]) < 1e-5 * np.abs(moved).max()


def test_seams_parts_and_clips_come_back_too(leafy, seasons, tmp_path):  # noqa: F811
    seamed(leafy, tmp_path / "seams.glb", translation=[1, 2, 3], scale=[2, 2, 2])
    write(athcodec.join(seasons), tmp_path / "clips.glb", animation="joints")
    for name, takes in (("seams", ["breeze"]), ("clips", list(seasons))):
        out = encoded(tmp_path / f"{name}.glb", tmp_path / "out.glb")
        assert main(["decode", str(out), str(tmp_path / "again.glb")]) == 0
        gltf = structure(tmp_path / "again.glb")
        assert [animation["name"] for animation in gltf["animations"]] == takes
        assert "_ATH_VERTEX" not in gltf["meshes"][0]["primitives"][0]["attributes"]
        for take in takes:
            with (
                read(tmp_path / "again.glb", takes=[take]) as again,
                read(tmp_path / f"{name}.glb", takes=[take]) as before,
            ):
                assert again.frame_count == before.frame_count
                assert distance(again.block(0, again.frame_count), world(out, take)[0]) < 1e-5 * 40
                assert again.metadata["start_frame"] == pytest.approx(before.metadata["start_frame"])


@pytest.mark.parametrize(
    "change, error",
    [
        (lambda gltf: gltf["extensions"]["ATH_motion"]["motions"].append({"bufferView": 0}), "2 motions"),
        (lambda gltf: gltf["extensions"]["ATH_motion"]["motions"][0].update(bufferView=99), "bufferView"),
        (lambda gltf: gltf["extensions"]["ATH_motion"]["motions"][0].update(bufferView=0), "first bytes"),
        (lambda gltf: gltf["extensions"]["ATH_motion"].update(motions=7), "motions"),
        (lambda gltf: moved_primitives(gltf)[0]["extensions"]["ATH_motion"].update(firstVertex=1), "vertex"),
        (lambda gltf: moved_primitives(gltf)[0]["extensions"]["ATH_motion"].update(firstVertex=1 << 50), "vertex"),
        (lambda gltf: moved_primitives(gltf)[0]["extensions"]["ATH_motion"].update(motion=1), "motion"),
        (lambda gltf: moved_primitives(gltf)[0].update(extensions={}), "primitive"),
        (
            lambda gltf: gltf["accessors"][moved_primitives(gltf)[0]["attributes"]["POSITION"]].update(count=1 << 40),
            "accessor",
        ),
        (lambda gltf: moved_primitives(gltf)[0]["attributes"].update(POSITION=99), "accessors"),
        (lambda gltf: moved_primitives(gltf)[0]["attributes"].update(_ATH_VERTEX=0), "_ATH_VERTEX"),
    ],
)
def test_a_file_that_lies_is_refused_in_one_line(change, error, leafy_out, tmp_path):
    bad = rewritten(leafy_out, tmp_path / "bad.glb", change)
    with pytest.raises(AthError, match=f"(?is){error}") as raised, athcodec.open(bad) as decoder:
        decoder.positions(0)
    assert "\n" not in str(raised.value)


def test_a_mesh_that_was_changed_is_told_from_the_one_of_the_motion(leafy_out, tmp_path):
    data = bytearray(leafy_out.read_bytes())
    place = data.index(stored_positions(leafy_out).tobytes())
    data[place] ^= 1
    (tmp_path / "bad.glb").write_bytes(data)
    with pytest.raises(WrongHostMesh):
        athcodec.open(tmp_path / "bad.glb")


def test_read_says_that_the_motion_is_the_extensions(leafy_out):
    with pytest.raises(ClipError, match="ATH_motion"):
        read(leafy_out)


def test_the_viewer_shows_a_glb(leafy_out, tmp_path):
    page = tmp_path / "page.html"
    assert main(["view", str(leafy_out), "--export", str(page)]) == 0
    assert page.stat().st_size > leafy_out.stat().st_size


@pytest.mark.parametrize("options", [["--unit", "cm"], ["--rest", "mean"], ["-o", "b.ath"]])
def test_options_that_would_change_the_mesh_are_refused(options, leafy, tmp_path, capsys, monkeypatch):  # noqa: F811
    monkeypatch.chdir(tmp_path)
    write(leafy, "source.glb")
    assert main(["encode", "source.glb", "--into", "out.glb", *options]) == 1
    assert "--into" in capsys.readouterr().err and not Path("out.glb").exists()


def test_a_glb_in_which_nothing_moves_is_refused(tmp_path, capsys):
    made = Maker()
    made.node(mesh=made.mesh({"POSITION": made.array(CUBE)}, "cube"))
    made.save(tmp_path / "still.glb")
    assert main(["encode", str(tmp_path / "still.glb"), "--into", str(tmp_path / "out.glb")]) == 1
    assert "got none that moves vertices" in capsys.readouterr().err
