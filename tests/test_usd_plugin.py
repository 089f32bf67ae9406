"""USD itself opens .ath files: stages reference them, and their samples are what decoding gives."""

import json
from pathlib import Path

import numpy as np
import pytest
from files import Parts
from moving_meshes import mixed_clip, swaying
from programs import run_script, usd_plugin_python

import athcodec
from athcodec.cli import main
from athcodec.decoding import container as ct
from athcodec.motion.clip import MotionClip

pytestmark = pytest.mark.programs

COMPARE = """
path, known, prims = sys.argv[1], np.load(sys.argv[2])["positions"], json.loads(sys.argv[3])
stage = Usd.Stage.Open(path)
shown = [UsdGeom.PointBased(stage.GetPrimAtPath(prim)) for prim in prims]
codes = shown[0].GetPointsAttr().GetTimeSamples()
assert len(codes) == len(known), codes
for code, frame in zip(codes, known):
    points = [np.array(prim.GetPointsAttr().Get(code)) for prim in shown]
    assert np.array_equal(np.concatenate(points), frame), code
    for own, prim in zip(points, shown):
        low, high = np.array(prim.GetExtentAttr().Get(code))
        assert (low <= own.min(axis=0)).all() and (high >= own.max(axis=0)).all()
print(json.dumps({
    "codes": codes, "rate": stage.GetTimeCodesPerSecond(), "unit": UsdGeom.GetStageMetersPerUnit(stage),
    "up": UsdGeom.GetStageUpAxis(stage), "default": str(stage.GetDefaultPrim().GetPath()),
    "types": [prim.GetPrim().GetTypeName() for prim in shown],
}))
"""


BEGIN = """
import json, sys, time
from concurrent.futures import ThreadPoolExecutor
import numpy as np
from pxr import Sdf, Tf, Usd, UsdGeom
"""


def script(text: str, *arguments: object) -> dict:
    """What a script prints last, which has the modules of BEGIN."""
    return json.loads(run_script(usd_plugin_python(), BEGIN + text, *arguments).splitlines()[-1])


def decoded(file: Path, clip: str | None = None, level: int | None = None) -> Path:
    out = file.with_suffix(".npz")
    with athcodec.open(file) as opened:
        frames = (opened if clip is None else opened.play(clip)).positions(level=level)
    np.savez(out, positions=frames.astype(np.float32, copy=False))
    return out


@pytest.fixture(scope="module")
def mesh_ath(tmp_path_factory):
    """A file of several objects, with polygons and arrays of all domains."""
    file = tmp_path_factory.mktemp("usd") / "mixed.ath"
    clip = mixed_clip(fps=24.0, start=1001)
    athcodec.encode(clip, file, rel_error=1e-3)
    return file, clip


def test_a_stage_has_the_positions_that_decoding_gives(sample_ath):
    found = script(COMPARE, sample_ath, decoded(sample_ath), json.dumps(["/clip/plant"]))
    assert found["types"] == ["BasisCurves"] and found["default"] == "/clip"
    assert found["rate"] == 30 and found["unit"] == 1 and found["up"] == "Y"


def test_objects_polygons_and_arrays_are_those_that_decode_writes(mesh_ath, tmp_path):
    file, clip = mesh_ath
    written = tmp_path / "written.usda"
    assert main(["decode", str(file), str(written)]) == 0
    prims = script(
        """
OWN = "athcodec"
def described(path):
    stage, prims = Usd.Stage.Open(path), {}
    for prim in stage.GetDefaultPrim().GetChildren():
        own = {}
        for attribute in prim.GetAuthoredAttributes():
            if attribute.GetCustomDataByKey("athcodec:guessed"):
                continue
            value = attribute.Get(1001)
            own[attribute.GetName()] = [
                str(attribute.GetTypeName()), attribute.GetMetadata("interpolation"),
                attribute.GetMetadata("elementSize") or 1,
                np.asarray(value).tolist() if not isinstance(value, str) else value, attribute.GetNumTimeSamples(),
            ]
        prims[prim.GetName()] = [str(prim.GetTypeName()), own]
    return prims
ours, theirs = described(sys.argv[1]), described(sys.argv[2])
assert ours == theirs, (ours, theirs)
print(json.dumps({name: [kind, sorted(own)] for name, (kind, own) in ours.items()}))
""",
        file,
        written,
    )
    assert len(prims) == len(clip.metadata["part_names"]) > 1
    assert {kind for kind, _ in prims.values()} == {"Mesh", "BasisCurves"}


def box_clip(metadata: dict, face_material: list[int] | None, has_colours: bool = False) -> MotionClip:
    """Two closed boxes."""
    corners = np.array([(x, y, z) for x in (0.0, 1.0) for y in (0.0, 1.0) for z in (0.0, 1.0)])
    box = np.array([(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)])
    rest = np.concatenate([corners, corners + [3.0, 0.0, 0.0]])
    attributes = {
        "face_vertex_counts": np.full(12, 4, np.int32),
        "face_vertex_indices": np.concatenate([box, box + 8]).ravel().astype(np.int32),
        "part_vertex_counts": np.array([8, 8], np.int32),
    }
    domains = {"face_vertex_counts": "face", "face_vertex_indices": "corner", "part_vertex_counts": "constant"}
    if has_colours:
        attributes["colors"], domains["colors"] = np.linspace(0, 1, 48, dtype=np.float32).reshape(16, 3), "vertex"
    if face_material is not None:
        attributes["face_material"], domains["face_material"] = np.array(face_material, np.int32), "face"
    metadata = {"part_kinds": ["mesh", "mesh"], "part_names": ["trunk", "leaf"]} | metadata | {"domains": domains}
    return MotionClip(swaying(rest, 4), np.arange(4) / 24, rest=rest, attributes=attributes, metadata=metadata)


MATERIALS = {
    "nothing": ({}, None),
    "stated sides": ({"part_usd": [{"doubleSided": "true"}, {}]}, None),
    "materials": ({"material_names": ["Bark", "no word", "2nd", "Bark"]}, [0, 1, 2, 7, -1, 3] + [2] * 6),
    "a name taken": ({"material_names": ["Bark"], "part_names": ["materials", "leaf"]}, [0] * 3 + [1] * 9),
    "no names": ({}, [0] * 12),
}


def test_faces_are_bound_to_the_materials_that_decode_writes(tmp_path):
    pairs = []
    for name, (metadata, face_material) in MATERIALS.items():
        file, written = tmp_path / f"{name}.ath", tmp_path / f"{name}.usda"
        athcodec.encode(box_clip(metadata, face_material), file, rel_error=1e-3, effort="fast")
        assert main(["decode", str(file), str(written)]) == 0
        pairs.append([str(file), str(written)])
    found = script(
        """
from pxr import UsdShade
def described(path):
    stage = Usd.Stage.Open(path)
    prims = [prim for prim in stage.Traverse() if not prim.IsA(UsdGeom.Xform)]
    bound = {str(p.GetPath()): str(UsdShade.MaterialBindingAPI(p).ComputeBoundMaterial()[0].GetPath()) for p in prims}
    subsets = [UsdGeom.Subset(prim) for prim in prims if prim.IsA(UsdGeom.Subset)]
    faces = {str(one.GetPath()): list(one.GetIndicesAttr().Get()) for one in subsets}
    families = [
        [str(token) for mesh in prims if mesh.IsA(UsdGeom.Mesh)
         for token in UsdShade.MaterialBindingAPI(mesh).GetMaterialBindSubsetsFamilyType()],
        [UsdGeom.Subset.ValidateFamily(UsdGeom.Imageable(mesh), "face", "materialBind")[0]
         for mesh in prims if mesh.IsA(UsdGeom.Mesh)],
    ]
    return [
        [[str(p.GetPath()), str(p.GetTypeName()), p.GetDisplayName(), p.GetAppliedSchemas(),
          p.HasAttribute("primvars:face_material")] for p in prims],
        bound, faces, families,
    ]
every = []
for file, written in json.loads(sys.argv[1]):
    every.append(described(file))
    assert every[-1] == described(written), (file, every[-1], described(written))
print(json.dumps([[bound, faces] for _, bound, faces, _ in every]))
""",
        json.dumps(pairs),
    )
    bound, faces = found[list(MATERIALS).index("materials")]
    assert bound["/clip/trunk/no_word"] == "/clip/materials/no_word" and bound["/clip/leaf"] == "/clip/materials/_nd"
    assert faces["/clip/trunk/Bark_2"] == [5]


def test_meshes_show_both_sides_and_only_colours_that_the_file_has(tmp_path):
    files = []
    for name, has_colours in (("stated sides", False), ("nothing", True)):
        files.append(str(tmp_path / f"{name}.ath"))
        athcodec.encode(box_clip(*MATERIALS[name], has_colours), files[-1], rel_error=1e-3, effort="fast")
    found = script(
        """
def shown(path):
    stage = Usd.Stage.Open(path)
    meshes = [UsdGeom.Mesh(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.Mesh)]
    sides = [mesh.GetDoubleSidedAttr() for mesh in meshes]
    return [[[one.Get(), one.GetCustomDataByKey("athcodec:guessed")] for one in sides],
            [mesh.GetDisplayColorAttr().IsAuthored() for mesh in meshes]]
print(json.dumps([shown(path) for path in sys.argv[1:]]))
""",
        *files,
    )
    assert found == [[[[True, None], [True, True]], [False] * 2], [[[True, True]] * 2, [True] * 2]]


def test_clips_are_variants_and_can_be_asked_for_by_name(medley_ath, medley_clips):
    names = list(medley_clips)
    text = """
stage = Usd.Stage.CreateInMemory()
prim = stage.DefinePrim("/tree")
prim.GetReferences().AddReference(sys.argv[1])
clips = prim.GetVariantSet("clip")
assert clips.GetVariantNames() == json.loads(sys.argv[3]) and clips.GetVariantSelection() == sys.argv[4]
clips.SetVariantSelection(sys.argv[5])
points = stage.GetPrimAtPath("/tree/plant").GetAttribute("points")
for code, frame in zip(points.GetTimeSamples(), np.load(sys.argv[2])["positions"], strict=True):
    assert np.array_equal(np.array(points.Get(code)), frame)
one = Usd.Stage.Open(f"{sys.argv[1]}:SDF_FORMAT_ARGS:clip={sys.argv[5]}")
assert not one.GetDefaultPrim().HasVariantSets()
alone = one.GetPrimAtPath("/clip/plant").GetAttribute("points")
own, shared = np.array(alone.GetTimeSamples()), np.array(points.GetTimeSamples())
assert np.allclose(own / one.GetTimeCodesPerSecond(), shared / stage.GetTimeCodesPerSecond(), rtol=0, atol=1e-5)
print(json.dumps(np.array_equal(alone.Get(own[3]), points.Get(shared[3]))))
"""
    last = names[-1]
    assert script(text, medley_ath, decoded(medley_ath, last), json.dumps(sorted(names)), names[0], last)


def test_a_level_can_be_asked_for(sample_ath):
    path = f"{sample_ath}:SDF_FORMAT_ARGS:level=1"
    script(COMPARE, path, decoded(sample_ath, level=1), json.dumps(["/clip/plant"]))


DYNAMIC = """
stage = Usd.Stage.CreateInMemory()
def points(prim):
    return stage.GetPrimAtPath(f"{prim.GetPath()}/plant").GetAttribute("points")
def shows(prim, key):
    codes = points(prim).GetTimeSamples()
    known = np.load(sys.argv[2])[key]
    return len(codes) == len(known) and all(np.array_equal(points(prim).Get(c), f) for c, f in zip(codes, known))
base = stage.CreateClassPrim("/_oak")
base.GetPayloads().AddPayload(sys.argv[1])
trees = [stage.DefinePrim(f"/tree{i}") for i in range(3)]
for tree in trees:
    tree.GetInherits().AddInherit("/_oak")
clip = trees[1].CreateAttribute("ath:clip", Sdf.ValueTypeNames.String, True, Sdf.VariabilityUniform)
level = trees[2].CreateAttribute("ath:level", Sdf.ValueTypeNames.Int, True, Sdf.VariabilityUniform)
clip.Set("Böe")
level.Set(0)
said = [shows(trees[0], "calm"), shows(trees[1], "Böe"), shows(trees[2], "calm 0")]
clip.Set("calm")
trees[2].GetVariantSet("clip").SetVariantSelection("Böe")
said += [shows(trees[1], "calm"), shows(trees[2], "Böe 0")]
for tree in trees:
    tree.SetInstanceable(True)
said.append(len({str(tree.GetPrototype().GetPath()) for tree in trees}))
trees[2].SetInstanceable(False)
level.Set(99)
said += [len(trees[2].GetChildren()), " ".join(map(str, stage.GetCompositionErrors()))]
print(json.dumps(said))
"""


def test_a_payload_shows_the_clip_and_the_level_that_attributes_of_its_prim_name(medley_ath, tmp_path):
    with athcodec.open(medley_ath) as file:
        frames = {name: file.play(name).positions(dtype=np.float32) for name in ("calm", "Böe")}
        frames |= {f"{name} 0": file.play(name).positions(level=0, dtype=np.float32) for name in ("calm", "Böe")}
    np.savez(tmp_path / "known.npz", **frames)
    *shown, prototypes, children, error = script(DYNAMIC, medley_ath, tmp_path / "known.npz")
    assert shown == [True] * 5 and prototypes == 3 and children == 0
    assert 'level: got "99"' in error


def test_flattened_and_exported_stages_hold_all_samples(sample_ath, tmp_path):
    text = """
stage = Usd.Stage.CreateInMemory()
stage.DefinePrim("/tree").GetPayloads().AddPayload(sys.argv[1])
flat = stage.Flatten().ExportToString()
path = sys.argv[3] + "/copied.usdc"
assert Sdf.Layer.FindOrOpen(sys.argv[1]).Export(path)
copied = Usd.Stage.Open(path)
copy = copied.GetPrimAtPath("/clip/plant").GetAttribute("points")
for code, frame in zip(copy.GetTimeSamples(), np.load(sys.argv[2])["positions"], strict=True):
    assert np.array_equal(np.array(copy.Get(code)), frame)
print(json.dumps(flat.count("point3f[] points.timeSamples")))
"""
    assert script(text, sample_ath, decoded(sample_ath), tmp_path) == 1


def test_a_hundred_stages_are_open_at_once_on_several_threads(sample_ath):
    text = """
known = np.load(sys.argv[2])["positions"]
stages = [Usd.Stage.Open(sys.argv[1]) for _ in range(100)]
def right(number):
    frame = number * 37 % len(known)
    points = stages[number % 100].GetPrimAtPath("/clip/plant").GetAttribute("points").Get(frame)
    return np.array_equal(np.array(points), known[frame])
with ThreadPoolExecutor(8) as pool:
    print(json.dumps(all(pool.map(right, range(400)))))
"""
    assert script(text, sample_ath, decoded(sample_ath))


@pytest.mark.parametrize(
    "what, says",
    [
        ("cut", "expected"),
        ("other", "Cannot determine file format|not an .ath|ath"),
        ("clip=nope", 'clip: got "nope"; expected one of'),
        ("level=99", 'level: got "99"; expected 0 to'),
        ("level=", "level"),
    ],
)
def test_what_cannot_be_opened_is_one_error_that_names_the_file(sample_ath, tmp_path, what, says):
    bad, data = tmp_path / "bad.ath", sample_ath.read_bytes()
    bad.write_bytes({"cut": data[:100], "other": b"nothing of the kind"}.get(what, data))
    path = f"{bad}:SDF_FORMAT_ARGS:{what}" if "=" in what else str(bad)
    text = """
try:
    layer = Sdf.Layer.FindOrOpen(sys.argv[1])
    print(json.dumps(["", bool(layer)]))
except Tf.ErrorException as error:
    print(json.dumps([str(error), False]))
"""
    error, opened = script(text, path)
    assert not opened and "bad.ath" in error
    assert any(part in error for part in says.split("|"))


def test_damaged_motion_is_reported_once_and_other_segments_play(tmp_path, sample_clip):
    file = tmp_path / "damaged.ath"
    athcodec.encode(sample_clip, file, rel_error=1e-3, segment_frames=40, ladder="none")
    data = bytearray(file.read_bytes())
    last = next(c for c, _ in Parts.of(bytes(data)).chunks if c.kind == ct.STEMS and c.segment == 2)
    data[last.offset + last.length // 2] ^= 1
    file.write_bytes(data)
    text = """
stage = Usd.Stage.Open(sys.argv[1])
points = stage.GetPrimAtPath("/clip/plant").GetAttribute("points")
said = []
for frame in (0, 100, 110):
    try:
        said.append(["", len(points.Get(frame) or [])])
    except Tf.ErrorException as error:
        said.append([str(error), 0])
print(json.dumps(said))
"""
    first, second, third = script(text, file)
    assert first == ["", sample_clip.vertex_count]
    assert "damaged.ath" in second[0] and second[1] == third[1] == 0 and third[0] == ""


def test_a_thousand_references_share_one_decoder(sample_ath):
    text = """
stage = Usd.Stage.CreateInMemory()
for i in range(1000):
    stage.DefinePrim(f"/forest/t{i}").GetReferences().AddReference(sys.argv[1])

stage.GetRootLayer().Export(sys.argv[2])
started = time.perf_counter()
stage = Usd.Stage.Open(sys.argv[2])
opened = time.perf_counter()
prims = [UsdGeom.PointBased(prim) for prim in stage.Traverse() if prim.IsA(UsdGeom.PointBased)]
sums = [sum(len(prim.GetPointsAttr().Get(frame)) for prim in prims) for frame in range(10)]
print(json.dumps([opened - started, time.perf_counter() - opened, sums]))
"""
    opened, composed, sums = script(text, sample_ath, sample_ath.with_suffix(".usdc"))
    print(f"1,000 references: opened in {opened:.2f} s, ten frames composed in {composed:.2f} s")
    assert sums == [1_001_000] * 10
