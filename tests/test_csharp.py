"""Ath.cs: what it declares is what the headers declare; in Mono every vector has the bits that C gives it."""

from __future__ import annotations

import ctypes.util
import os
import re
import subprocess
from itertools import product
from pathlib import Path

import plants
import pytest
from fuzz.targets import CORE
from programs import printed

import athcodec

TREE = Path(athcodec.__file__).parent / "sample" / "leafed_tree.ath"
VECTORS = Path(__file__).resolve().parent.parent / "spec" / "vectors" / "valid"
BINDING, EXAMPLES = CORE / "bindings" / "Ath.cs", CORE / "examples"

# ---- declarations ----

C_TEXT = "".join((CORE / "include" / f"{name}.h").read_text("utf-8").split("#ifdef ATH_PLAYER_IMPLEMENTATION")[0]
                 for name in ("ath", "ath_player"))  # fmt: skip
C_TEXT = re.sub(r"/\*.*?\*/", "", C_TEXT, flags=re.S).replace("const ", "")
C_NUMBERS = dict(re.findall(r"(ATH_\w+) = (\w+)", C_TEXT))
C_ENUMS = set(re.findall(r"typedef enum (\w+)", C_TEXT))
CS_TEXT = re.sub(r"//.*", "", BINDING.read_text("utf-8"))
SCALARS = {"int": "int", "uint": "uint32_t", "ushort": "uint16_t", "byte": "uint8_t", "ulong": "uint64_t", "double": "double"}
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
    return to != c and (to in ("char", "void") if kind == "byte" and to != "uint8_t" else to == (POINTEES | SCALARS)[kind])


def test_functions_are_declared_as_in_the_headers():
    c, cs = c_functions(), cs_functions()
    assert len(cs) > 30 and cs.keys() <= c.keys()
    for name, declared in cs.items():
        assert len(declared) == len(c[name]), name
        for one, (kind, is_pointer) in zip(c[name], declared):
            assert fits(one, kind, is_pointer), f"{name}: C has {one}, C# has {kind}"


def c_fields(name: str) -> list[tuple[str, str]]:
    found = []
    for kind, names in re.findall(r"(\w+) ([^;]+);", re.sub(r"\((\*\w+)\)\([^;]*\)", r"\1", struct_of(C_TEXT, rf"struct {name}"))):
        for one in names.split(","):
            stars, field, length = re.fullmatch(r"\s*([* ]*)(\w+)(?:\[(\w+)\])?", one).groups()
            own = "pointer" if stars else c_type(kind)
            found += [(field, own)] * int(C_NUMBERS.get(length, length) or 1)
    return found


def cs_fields(name: str) -> list[tuple[str, str]]:
    found = []
    for length, kind, names in re.findall(
        r"(?:SizeConst = (\d+)\)\]\s*)?(?:internal |public |^\s*)(\w+) (\w+(?:,\s*\w+)*);", struct_of(CS_TEXT, rf"struct {name}"), re.M
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
        assert re.fullmatch(rf"{wanted}(_?[xyz\d])?", snake.replace("float64", "_float64").replace("__", "_")), (field, wanted)


def test_constants_are_those_of_the_headers():
    for name in ("AthResult", "AthWrap", "AthMeasure", "AthKind"):
        members = re.findall(r"(\w+) = (\d+)", re.search(rf"enum {name} \{{(.*?)\}}", CS_TEXT)[1])
        assert len(members) > 2
        for member, value in members:
            assert C_NUMBERS["ATH_" + re.sub(r"(?<!^)(?=[A-Z])", "_", member).upper()] == value
    constants = dict(re.findall(r"(\w+) = (\d+)[,;]", CS_TEXT))
    assert constants["DefaultBudget"] == C_NUMBERS["ATH_PLAYER_BUDGET"] and int(C_NUMBERS["ATH_PLAYER_EXACT"], 16) == 2**31 - 1
    assert constants["SourceOrder"] == C_NUMBERS["ATH_SOURCE_ORDER"] and constants["LevelNameBytes"] == C_NUMBERS["ATH_LEVEL_NAME"]
    assert constants["FaultTextBytes"] == C_NUMBERS["ATH_FAULT_TEXT"]


# ---- in Mono ----

# Both programs print the same lines: of each file what the player returns, and the CRC-32C of what it shows.
C_VECTORS = r"""
#define ATH_PLAYER_IMPLEMENTATION
#include "ath_player.h"
#include <stdio.h>

int main(int argc, char **argv)
{
    for (int i = 1; i < argc; i++) {
        FILE *source = fopen(argv[i], "rb");
        fseek(source, 0, SEEK_END);
        size_t size = (size_t)ftell(source), count = 0, lines = 0;
        uint8_t *bytes = malloc(size);
        rewind(source);
        size = fread(bytes, 1, size, source);
        fclose(source);
        ath_player *player;
        ath_info info;
        int result = ath_player_open(&player, bytes, size, NULL, NULL);
        printf("%d %d\n", i, result);
        if (result == ATH_OK) {
            const ath_file *file = ath_player_file(player);
            ath_get_info(file, &info);
            ath_player_set_budget(player, ATH_PLAYER_EXACT);
            size_t floats = 3 * (size_t)info.vertex_count;
            float *xyz = calloc(floats, 4), *normals = calloc(floats, 4);
            result = ath_player_triangles(player, ATH_SOURCE_ORDER, NULL, &count);
            uint32_t *triangles = calloc(3 * count + 1, 4);
            if (result == ATH_OK) ath_player_triangles(player, ATH_SOURCE_ORDER, triangles, &count);
            ath_player_lines(player, ATH_SOURCE_ORDER, NULL, &lines);
            uint32_t *edges = calloc(2 * lines + 1, 4);
            ath_player_lines(player, ATH_SOURCE_ORDER, edges, &lines);
            printf("%zu %08x %zu %08x\n", count, ath_crc32c(0, (uint8_t *)triangles, 12 * count), lines,
                   ath_crc32c(0, (uint8_t *)edges, 8 * lines));
            for (int32_t clip = 0; clip < info.clip_count && clip < 2; clip++)
                for (int32_t level = 0; level < info.level_count; level++)
                    for (int32_t step = 0; step < 3; step++) {
                        ath_player_moment moment;
                        double seconds = step * 0.37 * ath_clips(file)[clip].duration;
                        result = ath_player_show(player, clip, seconds, ATH_LOOP, level, &moment);
                        if (result == ATH_OK)
                            result = ath_positions(file, moment.segments, moment.segment_count, moment.frame,
                                                   ATH_SOURCE_ORDER, xyz, 12);
                        ath_player_normals(triangles, count, xyz, 12, info.vertex_count, normals);
                        if (result != ATH_OK) printf("%d\n", result);
                        else printf("%d %08x %08x\n", moment.level, ath_crc32c(0, (uint8_t *)xyz, 4 * floats),
                                    ath_crc32c(0, (uint8_t *)normals, 4 * floats));
                    }
            ath_player_share shares[] = {{0, 0, ATH_LOOP, 0.1, 0.75}, {info.clip_count - 1, -1, ATH_CLAMP, 0.2, 0.25}};
            result = ath_player_blended_positions(player, shares, 2, ATH_SOURCE_ORDER, xyz, 12);
            if (result != ATH_OK) printf("%d\n", result);
            else printf("%08x\n", ath_crc32c(0, (uint8_t *)xyz, 4 * floats));
            ath_fade fade = {0};
            ath_fade_to(&fade, 0, 0.0);
            ath_fade_to(&fade, info.level_count - 1, 0.4);
            result = ath_player_faded_positions(player, 0, 0.1, ATH_LOOP, &fade, ATH_SOURCE_ORDER, xyz, 12);
            if (result != ATH_OK) printf("%d\n", result);
            else printf("%08x\n", ath_crc32c(0, (uint8_t *)xyz, 4 * floats));
            free(xyz), free(normals), free(triangles), free(edges);
            ath_player_close(player);
        }
        free(bytes);
    }
    return 0;
}
"""
CS_VECTORS = r"""
using System;
using System.IO;
using System.Runtime.InteropServices;
using Athcodec;

static class Vectors
{
    [DllImport("ath_player")] static extern uint ath_crc32c(uint crc, float[] floats, UIntPtr size);
    [DllImport("ath_player", EntryPoint = "ath_crc32c")] static extern uint ath_crc32c_of(uint crc, uint[] words, UIntPtr size);
    static string Sum(float[] floats) { return ath_crc32c(0, floats, (UIntPtr)(4 * floats.Length)).ToString("x8"); }
    static string Sum(uint[] words) { return ath_crc32c_of(0, words, (UIntPtr)(4 * words.Length)).ToString("x8"); }

    static void Print(Func<string> text)
    {
        try { Console.WriteLine(text()); }
        catch (AthException error) { Console.WriteLine((int)error.Result); }
    }

    static void Play(AthPlayer player)
    {
        var info = player.Info;
        var lines = player.Lines();
        float[] xyz = new float[3 * info.VertexCount], normals = new float[xyz.Length];
        player.SetBudget(AthPlayer.Exact);
        Console.WriteLine("{0} {1} {2} {3}", player.Triangles.Length / 3, Sum(player.Triangles), lines.Length / 2, Sum(lines));
        for (int clip = 0; clip < info.ClipCount && clip < 2; clip++)
            for (int level = 0; level < info.LevelCount; level++)
                for (int step = 0; step < 3; step++)
                    Print(() =>
                    {
                        int shown = player.Positions(clip, step * 0.37 * player.Clips[clip].Duration, AthWrap.Loop, level, xyz);
                        player.Normals(xyz, normals);
                        return shown + " " + Sum(xyz) + " " + Sum(normals);
                    });
        Print(() =>
        {
            player.BlendedPositions(new[] {
                new AthShare { Clip = 0, Level = 0, Wrap = AthWrap.Loop, Seconds = 0.1, Weight = 0.75 },
                new AthShare { Clip = info.ClipCount - 1, Level = -1, Wrap = AthWrap.Clamp, Seconds = 0.2, Weight = 0.25 } }, xyz);
            return Sum(xyz);
        });
        var fade = new AthFade();
        fade.To(0, 0);
        fade.To(info.LevelCount - 1, 0.4);
        Print(() => { player.FadedPositions(0, 0.1, AthWrap.Loop, ref fade, xyz); return Sum(xyz); });
    }

    static int Main(string[] files)
    {
        for (int i = 0; i < files.Length; i++)
        {
            var bytes = File.ReadAllBytes(files[i]);
            AthPlayer player = null;
            Console.Write("{0} ", i + 1);
            Print(() => { player = new AthPlayer(bytes, bytes.Length); return "0"; });
            if (player != null) using (player) Play(player);
        }
        return 0;
    }
}
"""


CALLS = r"""
using System;
using System.IO;
using System.Linq;
using Athcodec;

static class Calls
{
    static string Thrown(Action call)
    {
        try { call(); return "nothing"; }
        catch (Exception error) { return error.GetType().Name + " " + error.Message.Split('\n')[0]; }
    }

    static void Main(string[] words)
    {
        var bytes = File.ReadAllBytes(words[0]);
        var damaged = (byte[])bytes.Clone();
        damaged[damaged.Length / 2] ^= 1;
        foreach (int count in new[] { 0, 100, 1 << 14 }) Console.WriteLine(AthPlayer.Needed(bytes, count) > count);
        Console.WriteLine(AthPlayer.Needed(bytes, bytes.Length));
        Console.WriteLine(Thrown(() => new AthPlayer(new byte[100], 100)));
        Console.WriteLine(Thrown(() => new AthPlayer(bytes, 1000)));
        Console.WriteLine(Thrown(() => new AthPlayer(bytes, bytes.Length + 1)));
        var player = new AthPlayer(bytes, bytes.Length);
        var xyz = new float[3 * player.Info.VertexCount];
        var few = new float[xyz.Length - 1];
        Console.WriteLine(string.Join(", ", player.Clips.Select(clip => clip.Name + " " + clip.FrameCount)));
        Console.WriteLine(player.LevelName(player.Info.LevelCount - 1) + ", " + (player.LevelError(0) > player.LevelError(1)));
        Console.WriteLine(player.Metadata(null));
        Action[] calls = {
            () => player.Positions(0, 0, AthWrap.Loop, 0, few), () => player.Positions(player.Clips.Length, 0, AthWrap.Loop, 0, xyz),
            () => player.Normals(few, xyz), () => player.Normals(xyz, few), () => player.LevelName(99), () => player.LevelError(-1),
            () => player.Ranges(0, 0, 99, new AthRange[1]), () => player.ReadyLevel(-1), () => player.LevelFor(1, 1, 1, 1, 9),
            () => player.Tangents(xyz, few, xyz, xyz), () => player.WindPositions(new AthWind[0], 0, 0, 0, AthWrap.Loop, 0, xyz),
            () => player.BlendedPositions(new AthShare[0], xyz), () => player.Feed(bytes, bytes.Length + 1, 0) };
        foreach (var call in calls) Console.WriteLine(Thrown(call));
        player.Positions(0, 0, AthWrap.Loop, -1, xyz);
        var fade = new AthFade();
        for (int round = 0; round < 2; round++) // all that is allocated once is allocated in the first
        {
            int before = GC.CollectionCount(0);
            for (int frame = 0; frame < 30000; frame++)
            {
                double seconds = frame / 60.0;
                int shown = player.Positions(0, seconds, AthWrap.Loop, player.LevelFor(1e-3, 0.8, 1080), xyz);
                player.Ahead();
                player.Normals(xyz, xyz);
                fade.To(shown, 0.1);
                player.FadedPositions(0, seconds, AthWrap.Loop, ref fade, xyz);
            }
            if (round > 0) Console.WriteLine("{0} collections", GC.CollectionCount(0) - before);
        }
        player.Dispose();
        player.Dispose();
        Console.WriteLine(Thrown(() => player.Positions(0, 0, AthWrap.Loop, 0, xyz)));
        Console.WriteLine(Thrown(() => player.LevelFor(1, 1, 1)));
    }
}
"""
PLAYED = r"level (\d+) of (\d+), (\d+) of (\d+) bytes, (\d+) triangles, (\w+) with texture coordinates, [\d.]+ ms a frame\n"


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
        printed("mcs", "-langversion:6", "-warn:4", "-warnaserror", "-optimize", f"-out:{folder / name}.exe", BINDING, *paths)

        def run(*words: object, code: int = 0, **variables: str) -> str:
            settings = {"LD_LIBRARY_PATH": str(folder), **variables}
            return printed("mono", folder / f"{name}.exe", *words, code=code, env={**os.environ, **settings})

        return run

    return build_program


@pytest.mark.programs
def test_every_vector_has_the_same_bits_as_in_c(mono, tmp_path):
    files = sorted(VECTORS.glob("*.ath"))
    (tmp_path / "vectors.c").write_text(C_VECTORS)
    words = ["-O1", "-DATH_STATIC", "-ffp-contract=off", "-I", CORE / "include"]
    printed("python3", CORE / "amalgamate.py", tmp_path / "ath.c")
    printed("cc", *words, tmp_path / "vectors.c", tmp_path / "ath.c", "-lm", "-o", tmp_path / "vectors")
    wanted = printed(tmp_path / "vectors", *files).splitlines()
    shown = mono("vectors", CS_VECTORS)(*files).splitlines()
    assert shown == wanted
    played = [line for line in wanted if re.fullmatch(r"\d+ 0", line)]
    assert len(played) > 0.9 * len(files), "others lack the mesh of the host"


@pytest.mark.programs
def test_the_example_plays_at_the_level_of_its_distance_from_the_ranges_that_it_needs(mono, tmp_path):
    run, zero = mono("PlayPlant", EXAMPLES / "Plant.cs", EXAMPLES / "PlayPlant.cs"), "{0}"
    with athcodec.open(TREE) as decoder:
        levels, triangles = decoder.levels, len(decoder.faces)
    played = [re.fullmatch(PLAYED, run(TREE, distance, 300)).groups() for distance in (12, 400)]
    (near, count, fetched, size, faces, uv), (far, _, less, *_) = played
    assert (int(near), int(far), int(count)) == (len(levels) - 1, 0, len(levels)) and uv == "vertices"
    assert int(size) == TREE.stat().st_size and int(less) < int(fetched) < int(size) / 2 and int(faces) == triangles
    (tmp_path / "cut.ath").write_bytes(TREE.read_bytes()[:40_000])
    assert run(tmp_path / "cut.ath", 12, 10).startswith("level 0 of")
    for cut in (0, 10, 1000):
        (tmp_path / "cut.ath").write_bytes(TREE.read_bytes()[:cut])
        assert run(tmp_path / "cut.ath", 12, 10, code=1) == ""


@pytest.mark.programs
def test_calls_refuse_what_does_not_fit_and_allocate_nothing_for_a_frame(mono, tmp_path):
    (tmp_path / "plant.ath").write_bytes(athcodec.encode(plants.plant(branches=3, frames=40), rel_error=1e-2, effort="fast"))
    run = mono("calls", CALLS)
    # Garbage is collected after 64 kB: 30,000 frames that allocated anything would be collected 7 times at least.
    answers = run(tmp_path / "plant.ath", MONO_GC_PARAMS="nursery-size=64k").splitlines()
    print("\n".join(answers))
