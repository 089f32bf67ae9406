"""Ath.cs: what it declares is what the headers declare; in Mono every vector has the bits that C gives it."""

from __future__ import annotations

import ctypes.util
import dataclasses
import os
import re
from pathlib import Path

import pytest
from fuzz.targets import CORE
from programs import printed
from test_engines import small_mesh

import athcodec
from bench import engines as measured

TREE = Path(athcodec.__file__).parent / "sample" / "leafed_tree.ath"
VECTORS = Path(__file__).resolve().parent.parent / "spec" / "vectors" / "valid"
BINDING, EXAMPLES = CORE / "bindings" / "Ath.cs", CORE / "examples"
PROGRAMS = Path(__file__).resolve().parent / "csharp"

# ---- declarations ----

C_TEXT = "".join((CORE / "include" / f"{name}.h").read_text("utf-8").split("#ifdef ATH_PLAYER_IMPLEMENTATION")[0]
                 for name in ("ath", "ath_player"))  # fmt: skip
C_TEXT = re.sub(r"/\*.*?\*/", "", C_TEXT, flags=re.S).replace("const ", "")
C_NUMBERS = dict(re.findall(r"(ATH_\w+) = (\w+)", C_TEXT))
C_ENUMS = set(re.findall(r"typedef enum (\w+)", C_TEXT))
CS_TEXT = re.sub(r"//.*", "", BINDING.read_text("utf-8"))
SCALARS = {
    "int": "int",
    "uint": "uint32_t",
    "ushort": "uint16_t",
    "byte": "uint8_t",
    "ulong": "uint64_t",
    "double": "double",
}
SCALARS |= {"float": "float", "UIntPtr": "size_t", "IntPtr": "pointer", "void": "void", "AthWrap": "int"}
STRUCTS = {"AthInfo": "ath_info", "AthRange": "ath_range", "AthShare": "ath_player_share", "AthWind": "ath_wind"}
STRUCTS |= {"AthFade": "ath_fade", "Fault": "ath_fault_info", "Options": "ath_player_options", "Clip": "ath_clip"}
STRUCTS |= {"Moment": "ath_player_moment", "Array": "ath_array", "Metadata": "ath_metadata"}
POINTEES = STRUCTS | {"PlayerHandle": "ath_player", "FileHandle": "ath_file", "SegmentPair": "ath_segment *"}


def c_type(words: str) -> str:
    """A type of C: pointers as "T *" of one level, or "pointer" where only a pointer can be meant."""
    kind, stars = re.fullmatch(r"(?:struct )?(\w+) ?([* ]*)", words.replace("*", " * ").strip()).groups()
    kind = "int" if kind in C_ENUMS | {"int32_t"} else kind
    return kind + " *" * stars.count("*")


def c_functions() -> dict[str, list[str]]:
    """The result and the arguments of each function."""
    found = {}
    for result, name, arguments in re.findall(r"^(?:ATH_API )?([\w ]+?[ *]+)(ath_\w+)\(([^;{}]*)\);", C_TEXT, re.M):
        kinds = [re.sub(r"\w+$", "", " ".join(one.split())) for one in arguments.split(",")]
        found[name] = [c_type(result), *map(c_type, kinds)]
    return found


def cs_functions() -> dict[str, list[tuple[str, bool]]]:
    """The same of the externs, and whether an argument is a pointer."""
    found = {}
    for result, name, arguments in re.findall(r"static extern (\w+) (\w+)\((.*?)\);", CS_TEXT):
        found[name] = [(result, False)]
        for one in arguments.split(", "):
            kind, array = re.fullmatch(r"(?:\[Out\] )?(?:ref |out )?(\w+)(\[\])? \w+", one).groups()
            found[name].append((kind, array is not None or re.search(r"\b(ref|out) ", one) is not None))
    return found


def fits(c: str, kind: str, is_pointer: bool) -> bool:
    if kind.endswith("Handle"):
        return c == f"{POINTEES[kind]} *"
    if not is_pointer:
        return c.endswith("*") if kind == "IntPtr" else c == SCALARS[kind]
    to = c.removesuffix(" *")
    if kind == "IntPtr":
        return to.endswith("*")
    return to != c and (
        to in ("char", "void") if kind == "byte" and to != "uint8_t" else to == (POINTEES | SCALARS)[kind]
    )


def test_functions_are_declared_as_in_the_headers():
    c, cs = c_functions(), cs_functions()
    assert len(cs) > 30 and cs.keys() <= c.keys()
    for name, declared in cs.items():
        assert len(declared) == len(c[name]), name
        for one, (kind, is_pointer) in zip(c[name], declared):
            assert fits(one, kind, is_pointer), f"{name}: C has {one}, C# has {kind}"


def c_fields(name: str) -> list[tuple[str, str]]:
    found = []
    for kind, names in re.findall(
        r"(\w+) ([^;]+);", re.sub(r"\((\*\w+)\)\([^;]*\)", r"\1", struct_of(C_TEXT, rf"struct {name}"))
    ):
        for one in names.split(","):
            stars, field, length = re.fullmatch(r"\s*([* ]*)(\w+)(?:\[(\w+)\])?", one).groups()
            own = "pointer" if stars else c_type(kind)
            found += [(field, own)] * int(C_NUMBERS.get(length, length) or 1)
    return found


def cs_fields(name: str) -> list[tuple[str, str]]:
    found = []
    for length, kind, names in re.findall(
        r"(?:SizeConst = (\d+)\)\]\s*)?(?:internal |public |^\s*)(\w+) (\w+(?:,\s*\w+)*);",
        struct_of(CS_TEXT, rf"struct {name}"),
        re.M,
    ):
        for field in re.split(r",\s*", names):
            if kind == "SegmentPair":
                found += [(field, "pointer")] * 2
            else:
                found += [(field, SCALARS[kind])] * int(length or 1)
    return found


def struct_of(text: str, head: str) -> str:
    return re.search(head + r"\s*\{(.*?)^\s*\}", text, re.S | re.M)[1].replace("uint[]", "uint")


@pytest.mark.parametrize("name", STRUCTS)
def test_structs_have_the_fields_of_the_headers(name):
    cs, c = cs_fields(name), c_fields(STRUCTS[name])
    assert [kind for _, kind in cs] == [kind for _, kind in c]
    for (field, _), (wanted, _) in zip(cs, c):  # Those of an array bear its name, and a letter or number.
        snake = re.sub(r"(?<!^)(?=[A-Z])", "_", field).lower()
        assert re.fullmatch(rf"{wanted}(_?[xyz\d])?", snake.replace("float64", "_float64").replace("__", "_")), (
            field,
            wanted,
        )


def test_constants_are_those_of_the_headers():
    for name in ("AthResult", "AthWrap", "AthMeasure", "AthKind"):
        members = re.findall(r"(\w+) = (\d+)", re.search(rf"enum {name} \{{(.*?)\}}", CS_TEXT)[1])
        assert len(members) > 2
        for member, value in members:
            assert C_NUMBERS["ATH_" + re.sub(r"(?<!^)(?=[A-Z])", "_", member).upper()] == value
    constants = dict(re.findall(r"(\w+) = (\d+)[,;]", CS_TEXT))
    assert (
        constants["DefaultBudget"] == C_NUMBERS["ATH_PLAYER_BUDGET"]
        and int(C_NUMBERS["ATH_PLAYER_EXACT"], 16) == 2**31 - 1
    )
    assert (
        constants["SourceOrder"] == C_NUMBERS["ATH_SOURCE_ORDER"]
        and constants["LevelNameBytes"] == C_NUMBERS["ATH_LEVEL_NAME"]
    )
    assert constants["FaultTextBytes"] == C_NUMBERS["ATH_FAULT_TEXT"]


# ---- in Mono ----

# Both programs print the same lines: of each file what the player returns, and the CRC-32C of what it shows.


PLAYED = (
    r"level (\d+) of (\d+), (\d+) of (\d+) bytes, (\d+) triangles, "
    r"(\w+) with texture coordinates, ([\d.]+) ms a frame\n"
)


@pytest.fixture(scope="module")
def mono(tmp_path_factory):
    """A function that builds a program of C# with the binding, and returns a function that runs it."""
    folder = tmp_path_factory.mktemp("mono")
    build = "-DATH_BUILD_PLAYER=ON", "-DATH_BUILD_EXAMPLES=OFF"
    printed("cmake", "-S", CORE, "-B", folder / "build", *build)
    printed("cmake", "--build", folder / "build", "--target", "ath_player", "-j2")
    (folder / "libath_player.so").symlink_to(folder / "build" / "libath_player.so")
    config = f'<configuration><dllmap dll="zstd" target="{ctypes.util.find_library("zstd")}"/></configuration>'

    def build_program(name: str, *sources: Path | str):
        paths = []
        for i, source in enumerate(sources):
            paths.append(source if isinstance(source, Path) else folder / f"{name}{i}.cs")
            if isinstance(source, str):
                paths[-1].write_text(source)
        (folder / f"{name}.exe.config").write_text(config)
        printed(
            "mcs",
            "-langversion:6",
            "-warn:4",
            "-warnaserror",
            "-optimize",
            f"-out:{folder / name}.exe",
            BINDING,
            *paths,
        )

        def run(*words: object, code: int = 0, **variables: str) -> str:
            settings = {"LD_LIBRARY_PATH": str(folder), **variables}
            return printed("mono", folder / f"{name}.exe", *words, code=code, env={**os.environ, **settings})

        return run

    return build_program


@pytest.mark.programs
def test_every_vector_has_the_same_bits_as_in_c(mono, tmp_path):
    files = sorted(VECTORS.glob("*.ath"))
    words = ["-O1", "-DATH_STATIC", "-ffp-contract=off", "-I", CORE / "include"]
    printed("python3", CORE / "amalgamate.py", tmp_path / "ath.c")
    printed("cc", *words, PROGRAMS / "vectors.c", tmp_path / "ath.c", "-lm", "-o", tmp_path / "vectors")
    wanted = printed(tmp_path / "vectors", *files).splitlines()
    shown = mono("vectors", PROGRAMS / "Vectors.cs")(*files).splitlines()
    assert shown == wanted
    played = [line for line in wanted if re.fullmatch(r"\d+ 0", line)]
    assert len(played) > 0.9 * len(files), "others lack the mesh of the host"


@pytest.mark.programs
def test_the_example_plays_at_the_level_of_its_distance_from_the_ranges_that_it_needs(mono, tmp_path):
    run = mono("PlayPlant", EXAMPLES / "Plant.cs", EXAMPLES / "PlayPlant.cs")
    with athcodec.open(TREE) as decoder:
        levels, triangles = decoder.levels, 2 * len(decoder.file.faces)
    played = [re.fullmatch(PLAYED, run(TREE, distance, 300)).groups() for distance in (12, 400)]
    (near, count, fetched, size, faces, uv, ms), (far, _, less, *_, ms_far) = played
    version = re.search(r"version (\S+)", printed("mono", "--version"))[1]
    measured.record("Mono", version, float(ms), float(ms_far))
    assert (int(near), int(far), int(count)) == (len(levels) - 1, 0, len(levels)) and uv == "vertices"
    assert int(size) == TREE.stat().st_size and int(less) < int(fetched) < int(size) / 2 and int(faces) == triangles
    (tmp_path / "cut.ath").write_bytes(TREE.read_bytes()[:40_000])
    assert run(tmp_path / "cut.ath", 12, 10).startswith("level 0 of")
    for cut in (0, 10, 1000):
        (tmp_path / "cut.ath").write_bytes(TREE.read_bytes()[:cut])
        assert run(tmp_path / "cut.ath", 12, 10, code=1) == ""


@pytest.mark.programs
def test_calls_refuse_what_does_not_fit_and_allocate_nothing_for_a_frame(mono, tmp_path):
    clip = dataclasses.replace(small_mesh(), metadata={"unit": "m"})
    (tmp_path / "plant.ath").write_bytes(athcodec.encode(clip, rel_error=1e-2, effort="fast", attributes="all"))
    run = mono("calls", PROGRAMS / "Calls.cs")
    # Garbage is collected after 64 kB: 30,000 frames that allocated anything would be collected 7 times at least.
    answers = run(tmp_path / "plant.ath", TREE, MONO_GC_PARAMS="nursery-size=64k").splitlines()
    size = (tmp_path / "plant.ath").stat().st_size
    with athcodec.open(tmp_path / "plant.ath") as decoder:
        name, error, last = decoder.levels[-1].name, decoder.levels[0].rms_error, len(decoder.levels) - 1
    assert answers[:3] == ["True", "True", "0"]
    assert answers[3].startswith("AthException NOT_AN_ATH_FILE: file: got first bytes 0x00000000")
    assert answers[4].startswith("AthException MISSING: prelude: got 120 bytes")
    assert answers[5] == f"ArgumentException bytes: got {size}, expected at least {size + 1}"
    assert answers[6:9] == [" 6", f"{name}, {error!r}", '{"unit":"m"}']
    with athcodec.open(TREE) as decoder:
        uv = decoder.file.attributes["uv"]
    assert answers[9] == f"{len(uv)} x 2, {sum(uv.reshape(-1).tolist())!r}, no other"
    refused = [f"AthException a zstd frame is damaged: expected {uv.nbytes} bytes in it"]
    refused += ["ArgumentException xyz: got 35 numbers, expected 36", "AthException BAD_ARGUMENT"]
    refused += [
        "ArgumentException xyz: got 35 numbers, expected 36",
        "ArgumentException normals: got 35 numbers, expected 36",
    ]
    refused += [f"ArgumentOutOfRangeException got {level}, expected 0 to {last}" for level in (99, -1)]
    refused += [f"ArgumentOutOfRangeException got {some}, expected some of 1" for some in ("0 to 99", "-1 to -1")]
    refused += ["IndexOutOfRangeException Index was outside the bounds of the array."]
    refused += ["ArgumentException tangents: got 36 numbers, expected 48"]
    refused += ["ArgumentException box: got 35 numbers, expected 6"]
    refused += [
        "ArgumentException winds: got 0, expected one for each of 1 clips",
        "AthException BAD_ARGUMENT",
        answers[5],
    ]
    assert answers[10:-4] == refused and answers[-4] == "bounds hold"
    assert answers[-3] == "0 collections" and all(line.startswith("ObjectDisposedException") for line in answers[-2:])
