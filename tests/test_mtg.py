"""MTG files, written here after the published description of the format: chains, scales, abbreviations, and clips."""

from __future__ import annotations

import numpy as np
import pytest
from moving_meshes import damaged

import athcodec
from athcodec.errors import ClipError, SourceWarning
from athcodec.motion.clip import MotionClip
from athcodec.sources.mtg import mtg_branches, read_mtg

pytestmark = pytest.mark.formats

HEADER = """# a plant
CODE :\tFORM-A

CLASSES:
SYMBOL\tSCALE\tDECOMPOSITION\tINDEXATION\tDEFINITION
$\t0\tFREE\tFREE\tIMPLICIT
P \t1 \tCONNECTED\tFREE\tIMPLICIT
A\t2\t<-LINEAR\tFREE\tEXPLICIT
S\t2\tCONNECTED\tFREE\tEXPLICIT
U\t3\tNONE\tFREE\tIMPLICIT

DESCRIPTION :
LEFT\tRIGHT\tRELTYPE\tMAX
A\tA,S\t+\t?
U\tU\t<\t1

FEATURES:
NAME\tTYPE

MTG:

"""


def written(tmp_path, code, header=HEADER):
    (tmp_path / "plant.mtg").write_text(header + code)
    return tmp_path / "plant.mtg"


def described(mtg):
    """{branch: (labels, parent)}, as lists."""
    return [
        ([label for label, on in zip(mtg.labels, mtg.branch) if on == branch], int(parent))
        for branch, parent in enumerate(mtg.branch_parent)
    ]


PLANT = [
    (["U1", "U2", "U3", "U4"], -1),
    (["S1"], 0),
    (["S2"], 0),
    (["U1", "U2"], 0),
    (["S1"], 3),
    (["U1", "U2", "U3", "U4"], 0),
    (["U1"], 5),
    (["S1"], 6),
]


def test_the_ways_to_write_one_plant_give_the_same_branches(tmp_path):
    absolute = "TOPO\n/P1/A1\n" + "".join(
        f"/P1/A1{code}\n"
        for code in (
            "/U1<U2+S1",
            "/U1<U2+S2",
            "/U1<U2+A1",
            "/U1<U2+A1/U1<U2+S1",
            "/U1<U2<U3+A2",
            "/U1<U2<U3+A2/U1<U2<U3+A3",
            "/U1<U2<U3+A2/U1<U2<U3+A3/U1+S1",
            "/U1<U2<U3+A2/U1<U2<U3<U4",
            "/U1<U2<U3<U4",
        )
    )
    aliases = (
        "TOPO\t\tAlias\n/P1/A1\t\tA1\n(A1)/U1<U2+S1\n(A1)/U1<U2+S2\n(A1)/U1<U2+A1\n(A1)/U1<U2+A1/U1<U2+S1\n"
        "(A1)/U1<U2<U3+A2\t\tA2\n(A2)/U1<U2<U3+A3/U1+S1\n(A2)/U1<U2<U3<U4\n/P1/A1/U1<U2<U3<U4\n"
    )
    shifted = (
        "TOPO\n/P1/A1\n\t/U1<U2\n\t\t+S1\n\t\t+S2\n\t\t+A1/U1<U2+S1\n\t\t<U3\n\t\t\t+A2/U1<U2<U3\n"
        "\t\t\t\t+A3/U1+S1\n\t\t\t\t<U4\n\t\t\t<U4\n"
    )
    hats = (
        "TOPO\n/P1/A1\n^/U1<U2\n\t+S1\n\t+S2\n\t+A1/U1<U2+S1\n^<U3\n\t+A2/U1<<U3\t# a comment\n\t\t+A3/U1+S1\n"
        "\t^<U4\n^<U4\n"
    )
    for code in (absolute, aliases, shifted, hats):
        assert sorted(described(read_mtg(written(tmp_path, code)))) == sorted(PLANT), code


def test_undecomposed_entities_stand_for_themselves_and_unconnected_parts_follow(tmp_path):
    mtg = read_mtg(written(tmp_path, "TOPO\n/P1/A1\n^/U1+A2\n^<A3\n/P2/A1/U1\n"))
    assert described(mtg) == [(["U1"], -1), (["A2", "A3"], 0), (["U1"], -1)]
    mtg = read_mtg(written(tmp_path, "TOPO\n/P1/A1\n\t/U1+A2/U1\n\t/U5+A3/U1\n\t/U7\n"))
    assert described(mtg) == [(["U1", "U5", "U7"], -1), (["U1"], 0), (["U1"], 0)]


def test_entities_without_a_number_are_new_ones(tmp_path):
    mtg = read_mtg(written(tmp_path, "TOPO\n/P\n^/A\n^/U\n^<U\n^<U\n/P\n^/A\n^/U\n^<U\n"))
    assert mtg.parent.tolist() == [-1, 0, 1, -1, 3] and mtg.branch_parent.tolist() == [-1, -1]
    mtg = read_mtg(written(tmp_path, "TOPO\n/P/A/U<U\n\t+A/U\n\t+A/U<U\n/P/A/U\n"))
    assert described(mtg) == [(["U", "U"], -1), (["U"], 0), (["U", "U"], 0), (["U"], -1)]


def test_behind_a_branch_in_columns_of_its_own_a_hat_goes_on_from_what_bears_it(tmp_path):
    code = "TOPO\n/P1\n\t/A1\n\t\t/U1\n\t\t^<U2\n\t\t^+A2\n\t\t\t/U1\n\t\t\t^<U2\n\t\t^+A3\n\t\t\t/U1\n\t\t^<U3\n"
    mtg = read_mtg(written(tmp_path, code))
    assert described(mtg) == [(["U1", "U2", "U3"], -1), (["U1", "U2"], 0), (["U1"], 0)]
    assert mtg.parent.tolist() == [-1, 0, 1, 2, 1, 1]


def test_parts_without_a_hat_belong_to_the_entity_above_them(tmp_path):
    for hat in ("^", ""):
        code = f"TOPO\n/P1/A1\n{hat}/U1<U2\n\t+A1\n\t{hat}/U20<U21<A2\n\t{hat}/U25\n{hat}<U3\n#\tTOPO\tdiam\n"
        assert described(read_mtg(written(tmp_path, code))) == [(["U1", "U2", "U3"], -1), (["U20", "U21", "U25"], 0)]


def test_features_belong_to_the_last_entity_or_to_all_of_a_run(tmp_path):
    code = "ENTITY-CODE\t\tdiam\tnote\n/P1/A1/U1\t\t4\ta\n^<U2<<U4\t\t2.5\n^<U5<.<U7\t\t1\n*\t\t9\n\t+A2/U1\t\tb\n"
    mtg = read_mtg(written(tmp_path, code))
    assert mtg.labels == ["U1", "U2", "U3", "U4", "U5", "U6", "U7", "U1"]
    assert np.array_equal(mtg.features["diam"], [4, np.nan, np.nan, 2.5, 1, 1, 1, np.nan], equal_nan=True)
    assert mtg.edges.tolist() == [[0, 1], [1, 2], [2, 3], [3, 4], [4, 5], [5, 6], [6, 7]]


def test_what_no_branch_has_is_named(tmp_path):
    path = written(tmp_path, "TOPO\t\tdiam\tdate\n/P1/A1/U1\t\t4\t1\n*\t\t5\t2\n^<U2\t\t3\t1\n*\t\t4\t2\n")
    clip = MotionClip(np.zeros((1, 2, 3)), np.zeros(1))
    with pytest.warns(SourceWarning, match=r"not read: features diam, date; 2 rows of later dates \(\*\)$"):
        assert mtg_branches(path, clip)[0].tolist() == [0, 0]


@pytest.mark.parametrize("axes", ["X\tY\tZ", "xx\tyy\tzz"])
def test_coordinates_have_other_names_too(tmp_path, axes):
    clip, *_ = measured_clip()
    wanted = mtg_branches(written(tmp_path, MEASURED), clip)
    found = mtg_branches(written(tmp_path, MEASURED.replace("XX\tYY\tZZ", axes)), clip)
    assert all(map(np.array_equal, found, wanted))


MEASURED = (
    "TOPO\t\t\tXX\tYY\tZZ\n/P1\n^/A1\t\t\t0\t0\t0\n^/U1<<U4\t\t\t0\t4\t0\n"
    "\t+A2/U1<<U3\t\t3\t4\t0\n^<U5<U6\t\t\t0\t8\t0\n"
    "\t+A3/U1\t\t\t\t\n\t\t+S1\t-2\t8\t0\n"
)


def measured_clip():
    """Rings of three vertices about the lines that MEASURED describes, in a random order."""
    lines = [([0, 0, 0], [0, 8, 0], 9), ([0.5, 4, 0], [3, 4, 0], 6), ([-0.5, 8, 0], [-2, 8, 0], 4)]
    points, branch, along = [], [], []
    for number, (start, stop, count) in enumerate(lines):
        for share in np.linspace(0, 1, count):
            centre = np.array(start) * (1 - share) + np.array(stop) * share
            for angle in (0, 2, 4):
                points.append(centre + 0.1 * np.array([0, np.cos(angle), np.sin(angle)]))
                branch.append(number)
                along.append(share)
    order = np.random.default_rng(0).permutation(len(points))
    rest = np.array(points, np.float32)[order]
    clip = MotionClip(rest + np.zeros((3, 1, 1), np.float32), np.arange(3) / 24)
    return clip, np.array(branch)[order], np.array(along)[order]


def test_vertices_go_to_the_nearest_piece_of_the_plant(tmp_path):
    clip, wanted, along = measured_clip()
    branch, parent, stem_index = mtg_branches(written(tmp_path, MEASURED), clip)
    clear = (wanted != 0) | (np.abs(clip.rest[:, 1] - 4) > 0.2) & (clip.rest[:, 1] < 7.8)
    assert np.array_equal(branch[clear], wanted[clear]) and parent.tolist() == [-1, 0, 0]
    trunk = np.flatnonzero((branch == 0) & clear)
    in_order = trunk[np.argsort(stem_index[trunk])]
    assert (np.diff(along[in_order]) >= -1e-9).all()
    again = MotionClip(clip.positions, clip.time, branch, parent, stem_index=stem_index)
    athcodec.encode(again, tmp_path / "a.ath")


def test_as_many_parts_as_vertices_are_taken_in_order(tmp_path):
    path = written(tmp_path, "TOPO\n/P1/A1/U1<U2\n\t+A2/U1<U2\n^<U3\n")
    clip = MotionClip(np.random.default_rng(0).random((2, 5, 3)), np.arange(2.0))
    branch, parent, stem_index = mtg_branches(path, clip)
    assert branch.tolist() == [0, 0, 1, 1, 0] and parent.tolist() == [-1, 0] and stem_index.tolist() == [0, 1, 0, 1, 2]
    with pytest.raises(ClipError, match="got 5 parts without coordinates, expected 6 as vertices"):
        mtg_branches(path, MotionClip(np.zeros((1, 6, 3)), np.zeros(1)))


def test_a_plant_that_lies_elsewhere_is_refused(tmp_path):
    clip, *_ = measured_clip()
    far = MotionClip(np.asarray(clip.positions) * np.float32(100), clip.time)
    with pytest.raises(ClipError, match="are its units and axes the clip's"):
        mtg_branches(written(tmp_path, MEASURED), far)


REFUSED = {
    "no MTG": ("v 0 0 0\n", "got no section MTG:", ""),
    "FORM-B": ("TOPO\n/P1\n", "got 'FORM-B', expected FORM-A", HEADER.replace("FORM-A", "FORM-B")),
    "no columns": ("", "got no row TOPO", HEADER),
    "other columns": ("/P1\n", "line 22: got '/P1', expected TOPO", HEADER),
    "no entities": ("TOPO\n", "got no entities", HEADER),
    "no class": ("TOPO\n/P1/Q1\n", "line 23: got the class 'Q'", HEADER),
    "no code": ("TOPO\n/P1=A1\n", "got the code '=A1'", HEADER),
    "nothing above": ("TOPO\n\t^<U1\n", "got \\^ in a column without", HEADER),
    "no alias": ("TOPO\n(B)/U1\n", "got the alias 'B'", HEADER),
    "a run downward": ("TOPO\n/P1/A1/U5<<U2\n", "expected it behind a lower number", HEADER),
    "a run without end": ("TOPO\n/P1/A1/U5<<U999999999\n", "got more than 4194304 entities", HEADER),
    "two codes": ("TOPO\t\tdiam\n/P1\t/A1\n", "got the codes", HEADER),
    "a branch on nothing": ("TOPO\n+P1\n", "at the beginning, expected /", HEADER),
}


@pytest.mark.parametrize("code, message, header", REFUSED.values(), ids=REFUSED)
def test_what_is_no_mtg_is_refused_with_its_line(tmp_path, code, message, header):
    path = written(tmp_path, code, header)
    with pytest.raises(ClipError, match=message) as caught:
        read_mtg(path)
    assert str(path) in str(caught.value)


def test_an_mtg_in_place_of_a_motion_is_refused_with_what_to_do(tmp_path):
    with pytest.raises(ClipError, match=r"plant\.mtg: holds branches and no motion .*, with --hierarchy"):
        athcodec.read(written(tmp_path, "TOPO\n/P1\n"))


def test_damaged_files_are_refused_with_a_clip_error(tmp_path):
    path, refused = written(tmp_path, MEASURED), 0
    for data in damaged(path.read_bytes(), cuts=60, changes=240):
        path.write_bytes(data)
        try:
            read_mtg(path)
        except ClipError:
            refused += 1
    assert 30 < refused < 300
