"""Arrays that other programs wrote, in HDF5, NumPy and MATLAB files or in memory: which is taken for the positions, in
which order of axes, at which times; what is asked, and what is said."""

from __future__ import annotations

import warnings
from types import SimpleNamespace

import h5py
import numpy as np
import pytest
from moving_meshes import survives_damage
from plants import awkward

import athcodec
from athcodec.cli import main
from athcodec.errors import ClipError, GuessWarning, SourceWarning
from athcodec.sources import ReadOptions, find_format, mat

HEIGHT, TIMES = np.linspace(0.0, 2.0, 18), np.array([0.0, 0.1, 0.25, 0.3, 0.5, 0.9])
BENT = 0.1 * np.sin(3 * TIMES)[:, None] * HEIGHT**2
MOTION = np.stack([BENT, np.tile(HEIGHT, (6, 1)), 0 * BENT], axis=2)  # (6, 18, 3)
TURNED = MOTION.transpose(1, 0, 2)
EDGES = np.stack([np.arange(17), np.arange(1, 18)], axis=1)


def assert_motion(clip, motion=MOTION, times=TIMES):
    assert np.array_equal(clip.block(0, len(motion)), motion)
    assert np.allclose(clip.time, times, rtol=0, atol=1e-12)


def hdf5(path, arrays, attrs=None):
    with h5py.File(path, "w") as file:
        for name, values in arrays.items():
            file[name] = values
        for name, values in (attrs or {}).items():
            place, _, key = name.rpartition("@")
            file[place or "/"].attrs[key] = values
    return path


def npz(path, arrays, attrs=None):
    np.savez(path.with_suffix(".npz"), **{name.replace("/", "."): values for name, values in arrays.items()})
    return path.with_suffix(".npz")


def matlab73(path, arrays):
    """A file as MATLAB writes it by `save -v7.3`: dimensions reversed, text as uint16, its version in front."""
    path = path.with_suffix(".mat")
    with h5py.File(path, "w", userblock_size=512) as file:
        for name, values in arrays.items():
            is_text = isinstance(values, str)
            shown = np.atleast_2d(np.array(list(values.encode("utf-16-le")[::2]), np.uint16) if is_text else values)
            file[name] = shown.T
            file[name].attrs["MATLAB_class"] = np.bytes_(
                "char" if is_text else shown.dtype.name.replace("float64", "double")
            )
    with open(path, "r+b") as file:
        file.write(b"MATLAB 7.3 MAT-file, Platform: GLNXA64".ljust(124) + b"\0\2IM")
    return path


def matlab5(path, arrays):
    from scipy.io import savemat

    savemat(path.with_suffix(".mat"), arrays)
    return path.with_suffix(".mat")


# ---- which array ----


def test_positions_in_a_group_are_found_with_what_belongs_to_them(tmp_path):
    arrays = {
        "plant/positions": MOTION,
        "plant/time": TIMES[:, None],
        "plant/radius": HEIGHT,
        "edges": EDGES,
        "wind": TIMES,
    }
    path = hdf5(tmp_path / "a.h5", arrays, {"plant@unit": "cm", "plant/positions@note": "by hand"})
    with pytest.warns(GuessWarning, match=r"plant/positions \(6, 18, 3\) float64 was taken for them; --dataset"):
        clip = athcodec.read(path)
    with clip:
        assert_motion(clip)
        assert clip.metadata == {"unit": "cm"} and clip.branch_count == 1
        assert sorted(clip.attributes) == ["radius", "wind"]
        assert clip.not_read == {"note of a dataset": ["plant/positions@note"]}
    for dataset in ("/plant/positions", "plant", "/plant/"):
        with athcodec.read(path, dataset=dataset) as clip:
            assert_motion(clip)


FILES = {"hdf5": hdf5, "npz": npz}


@pytest.mark.parametrize("write", FILES.values(), ids=FILES)
def test_an_error_lists_the_arrays_with_their_shapes_and_names_the_options(tmp_path, write):
    path = write(tmp_path / "a.h5", {"alpha": MOTION, "beta": 2 * MOTION, "t": TIMES})
    listed = r"the file has alpha \(6, 18, 3\) float64, beta \(6, 18, 3\) float64, t \(6,\) float64"
    with pytest.raises(ClipError, match=f"got several, alpha, beta, expected .* --dataset .* --axes .*; {listed}"):
        athcodec.read(path)
    with pytest.raises(ClipError, match=f"dataset: got '/gamma', expected an array; {listed}"):
        athcodec.read(path, dataset="/gamma")
    with pytest.raises(ClipError, match=rf"got shape \(6,\), expected \(frames, vertices, 3\); --dataset .*; {listed}"):
        athcodec.read(path, dataset="t")
    with pytest.warns(GuessWarning, match="t was taken for the seconds"), athcodec.read(path, dataset="beta") as clip:
        assert_motion(clip, 2 * MOTION)
        assert np.array_equal(clip.attributes["alpha"], MOTION)


@pytest.mark.formats
def test_coordinates_in_arrays_of_their_own_are_refused_with_what_to_do(tmp_path):
    path = npz(tmp_path / "a", {name: MOTION[..., axis] for axis, name in enumerate("XYZ")})
    with pytest.raises(ClipError, match="x, y and z in arrays of their own have to be stacked into one"):
        athcodec.read(path)


@pytest.mark.formats
def test_one_that_is_called_as_positions_are_is_taken_and_the_others_are_named(tmp_path):
    path = hdf5(tmp_path / "a.h5", {"run/velocity": 3 * MOTION, "run/Position": MOTION, "time": TIMES})
    with pytest.warns(GuessWarning, match="run/Position .* was taken for them, not run/velocity;"):
        with athcodec.read(path) as clip:
            assert_motion(clip)


@pytest.mark.formats
def test_arrays_of_another_clip_in_the_file_are_named(tmp_path):
    arrays = {
        f"{name}/{key}": values for name in ("calm", "gale") for key, values in (("positions", MOTION), ("time", TIMES))
    }
    path = hdf5(tmp_path / "a.h5", arrays)
    with pytest.raises(ClipError, match="got several, calm/positions, gale/positions"):
        athcodec.read(path)
    with pytest.warns(SourceWarning, match="not read: dataset calm/positions, calm/time"):
        with athcodec.read(path, dataset="gale") as clip:
            assert_motion(clip)
            assert clip.attributes == {}


@pytest.mark.formats
def test_the_numbers_of_an_xdmf_file_lead_to_it(tmp_path):
    (tmp_path / "beam.xdmf").write_text("<Xdmf/>")
    path = hdf5(tmp_path / "beam.h5", {"Mesh/mesh/geometry": MOTION[0], "Function/u/0": MOTION[0]})
    with pytest.raises(ClipError, match="beam.xdmf beside it lists what is in it: encode that"):
        athcodec.read(path)


def test_an_array_without_a_name_is_the_positions(tmp_path, recwarn):
    np.savez(tmp_path / "a.npz", MOTION)
    np.save(tmp_path / "a.npy", MOTION.astype(">f4"))
    np.save(tmp_path / "f.npy", np.asfortranarray(MOTION))
    for name, motion in (("a.npz", MOTION), ("a.npy", MOTION.astype("f4")), ("f.npy", MOTION)):
        with athcodec.read(tmp_path / name, fps=24) as clip:
            assert_motion(clip, motion, np.arange(6) / 24)
            assert clip.metadata == {"fps": 24}
    assert not recwarn.list


@pytest.mark.formats
def test_a_broken_array_is_refused_and_named(tmp_path):
    path = tmp_path / "a.npy"
    np.save(path, MOTION)
    whole = path.read_bytes()
    for data in (
        whole[:-1],
        whole + b"\0",
        whole[:90],
        whole.replace(b"'<f8'", b"'|O8'"),
        whole.replace(b"(6, 18", b"(-6, 8"),
    ):
        path.write_bytes(data)
        with pytest.raises(ClipError, match="a.npy") as caught:
            athcodec.read(path).block(0, 6)
        assert "\n" not in str(caught.value)
    np.save(path, {"a": 1})
    with pytest.raises(ClipError, match="a.npy"):
        athcodec.read(path)
    path.write_bytes(whole)
    with athcodec.read(path) as clip:
        path.write_bytes(whole[:400])
        with pytest.raises(ClipError, match="end of the file"):
            clip.block(3, 6)


@pytest.mark.formats
@pytest.mark.parametrize("name", ["a.npy", "turned.npy", "group.h5", "matlab.mat"])
def test_damaged_files_are_refused_with_a_clip_error(tmp_path, name):
    path = tmp_path / name
    options = {"axes": "vertices,frames,xyz"} if name == "turned.npy" else {}
    if name.endswith("npy"):
        np.save(path, TURNED if options else MOTION)
    elif name == "group.h5":
        hdf5(path, {"plant/position": MOTION, "plant/t": TIMES, "plant/faces": EDGES}, {"plant@dt": 0.1})
    else:
        matlab73(path, {"positions": MOTION, "time": TIMES[:, None], "unit": "cm"})
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", SourceWarning)
        refused = survives_damage(path, lambda: athcodec.read(path, **options), cuts=15, changes=60)
    assert refused > 12


# ---- axes ----

ORDERS = {
    "vertices,frames,xyz": TURNED,
    "xyz,vertices,frames": MOTION.T,
    "frames,xyz,vertices": MOTION.transpose(0, 2, 1),
    "frames,vertices+xyz": MOTION.reshape(6, 54),
    "frames,xyz+vertices": MOTION.transpose(0, 2, 1).reshape(6, 54),
    "xyz+frames,vertices": MOTION.transpose(2, 0, 1).reshape(18, 18),
    "frames+xyz,vertices": MOTION.transpose(0, 2, 1).reshape(18, 18),
    "vertices+xyz,frames": MOTION.transpose(1, 2, 0).reshape(54, 6),
    "1,frames,vertices,xyz": MOTION[None],
    "time,point,axis": MOTION,
}


@pytest.mark.parametrize("axes, array", ORDERS.items(), ids=ORDERS)
def test_axes_in_any_order_are_read_as_they_are_named(tmp_path, axes, array):
    hdf5(tmp_path / "a.h5", {"positions": array, "time": TIMES})
    np.savez(tmp_path / "a.npz", positions=array, time=TIMES)
    np.savez_compressed(tmp_path / "b.npz", positions=array, time=TIMES)
    for name in ("a.h5", "a.npz", "b.npz"):
        with athcodec.read(tmp_path / name, axes=axes) as clip:
            assert_motion(clip)
            assert np.array_equal(clip.block(2, 5), MOTION[2:5])


def test_a_single_frame_is_an_array_without_frames(tmp_path):
    np.save(tmp_path / "a.npy", MOTION[3])
    with pytest.raises(
        ClipError, match=r"got shape \(18, 3\), expected .*; say the order of its axes: --axes vertices,xyz"
    ):
        athcodec.read(tmp_path / "a.npy")
    with athcodec.read(tmp_path / "a.npy", axes="vertices,xyz") as clip:
        assert np.array_equal(clip.block(0, 1), MOTION[3:4])


@pytest.mark.parametrize(
    "axes", ["", "frames,vertices", "vertices,frames", "frames+vertices,xyz", "frames,frames,xyz", "x,y,z"]
)
def test_axes_that_are_none_are_refused(tmp_path, axes, capsys):
    with pytest.raises(ValueError, match="axes: got .*expected the order"):
        athcodec.read(tmp_path / "a.npy", axes=axes)
    with pytest.raises(SystemExit):
        main(["encode", "a.npy", "a.ath", "--axes", axes])
    assert "expected the order" in capsys.readouterr().err


KNOWN = {
    "times": ({"time": TIMES}, "time has 6 rows"),
    "branches": ({"vertex_branch": np.zeros(18, int), "branch_parent": np.array([-1])}, "vertex_branch has 18 rows"),
    "a rest pose": ({"rest": MOTION[0]}, "rest has 18 rows"),
    "faces": ({"faces": np.array([[0, 1, 17]])}, "faces name vertex 17"),
    "edges": ({"edges": EDGES}, "edges name vertex 17"),
    "times of another name": ({"t": TIMES}, "t has 6 rows"),
}


@pytest.mark.parametrize("arrays, words", KNOWN.values(), ids=KNOWN)
def test_vertices_before_frames_are_refused_where_anything_tells(tmp_path, arrays, words):
    advice = '--axes vertices,frames,xyz (axes="vertices,frames,xyz")'
    path = npz(tmp_path / "a", {"positions": TURNED[:, :4] if "faces" in arrays else TURNED} | arrays)
    with pytest.raises(ClipError, match=words) as caught:
        athcodec.read(path)
    assert advice in str(caught.value)
    of_array = {name: values for name, values in arrays.items() if name in ("faces", "vertex_branch", "branch_parent")}
    if of_array:
        with pytest.raises(ClipError, match=words) as caught:
            athcodec.encode(TURNED[:, :4], **of_array)
        assert advice in str(caught.value)


def test_vertices_before_frames_are_asked_about_where_frames_look_like_paths(tmp_path):
    path = npz(tmp_path / "a", {"positions": TURNED})
    question = (
        "18 frames of 6 vertices, but each frame looks like the path of one vertex; pass --axes vertices,frames,xyz"
    )
    with pytest.warns(GuessWarning, match=question):
        athcodec.read(path).close()
    one = {"vertex_branch": np.zeros(18, int), "branch_parent": [-1], "max_error": 0.01, "effort": "fast"}
    with pytest.warns(GuessWarning, match=question):
        athcodec.encode(TURNED, max_error=1.0, effort="fast")
    assert athcodec.encode(TURNED, axes="vertices,frames,xyz", **one) == athcodec.encode(MOTION, **one)
    with athcodec.read(path, axes=("frames", "vertices", "xyz")) as clip:  # Who says so is not asked.
        assert clip.frame_count == 18


def test_plants_of_all_kinds_are_not_asked_about(recwarn):
    for seed, (shape, motion) in enumerate([("stem", "sway"), ("stem", "grow"), ("cloud", "sway"), ("stem", "noise")]):
        clip = awkward(seed=seed, branches=6, longest=7, frames=40, shape=shape, motion=motion)
        athcodec.encode(
            clip.block(0, 40),
            rel_error=0.05,
            effort="fast",
            vertex_branch=clip.vertex_branch,
            branch_parent=clip.branch_parent,
        )
    travelling = MOTION + np.linspace(0, 60, 6)[:, None, None]
    athcodec.encode(travelling, rel_error=0.05, effort="fast", vertex_branch=np.zeros(18, int), branch_parent=[-1])
    assert not recwarn.list


def test_names_of_dimensions_state_the_order(tmp_path):
    with h5py.File(tmp_path / "a.h5", "w") as file:  # As netCDF 4 has them.
        file["position"] = TURNED
        for axis, (name, values) in enumerate((("vertex", None), ("time", TIMES), ("axis", None))):
            file[name] = np.zeros(TURNED.shape[axis], np.float32) if values is None else values
            file[name].make_scale(
                name if values is not None else "This is a netCDF dimension but not a netCDF variable. 9"
            )
            file["position"].dims[axis].attach_scale(file[name])
    with pytest.warns(GuessWarning, match="position .* was taken"), athcodec.read(tmp_path / "a.h5") as clip:
        assert_motion(clip)
        assert clip.attributes == {} and clip.not_read == {}


def test_an_array_of_xarray_has_its_times_unit_and_order():
    class DataArray(SimpleNamespace):
        shape, dtype = TURNED.shape, TURNED.dtype

        def __getitem__(self, index):
            return TURNED[index]

    attrs = {"unit": "cm", "fps": 99, "long_name": "x"}
    array = DataArray(dims=("vertex", "time", "axis"), coords={"time": TIMES}, attrs=attrs)
    one = {"vertex_branch": np.zeros(18, int), "branch_parent": [-1], "max_error": 0.01}
    with athcodec.open(athcodec.encode(array, **one)) as decoder:
        assert np.allclose(decoder, MOTION, atol=0.01) and np.allclose(decoder.time, TIMES)
        assert decoder.metadata["unit"] == "cm"
    with athcodec.open(athcodec.encode(array, fps=25, **one)) as decoder:
        assert np.allclose(decoder.time, np.arange(6) / 25)


def test_what_holds_arrays_is_no_array_and_its_arrays_are_named(tmp_path):
    path = hdf5(tmp_path / "a.h5", {"positions": MOTION, "time": TIMES})
    with (
        h5py.File(path) as file,
        pytest.raises(ClipError, match=r"got a File, expected one of its arrays: positions \(6, 18, 3\)"),
    ):
        athcodec.encode(file)
    with np.load(npz(path, {"a": MOTION})) as archive, pytest.raises(ClipError, match="got a NpzFile, .*: a$"):
        athcodec.encode(archive)
    with pytest.raises(ClipError, match=r"got a dict, expected one of its arrays: x \(6, 18, 3\)"):
        athcodec.encode({"x": MOTION})


# ---- times ----

STATED = {
    "t": ({"t": TIMES}, {}, TIMES, "t was taken for the seconds"),
    "Times, a column": ({"Times": TIMES[:, None]}, {}, TIMES, "Times was taken"),
    "milliseconds": ({"time": TIMES * 1000}, {"time@units": "ms"}, TIMES, None),
    "hours since": ({"time": TIMES / 3600}, {"time@units": "hours since 2020-01-01"}, TIMES, None),
    "an unknown unit": (
        {"time": TIMES},
        {"time@units": "fortnights"},
        TIMES,
        "time is in 'fortnights', which was taken",
    ),
    "dt of the file": ({}, {"@dt": 0.04}, np.arange(6) / 25, "dt 0.04 was taken for 25 frames a second"),
    "frame rate of the positions": ({}, {"positions@frame_rate": 25}, np.arange(6) / 25, "frame_rate 25 was taken"),
    "times of the file": ({}, {"@times": TIMES}, TIMES, "the attribute times was taken for the seconds"),
    "times of the positions": ({}, {"positions@t": TIMES}, TIMES, "the attribute t was taken for the seconds"),
    "a dataset of one number": ({"dt": [[0.04]]}, {}, np.arange(6) / 25, "dt 0.04 was taken"),
    "fps in a dataset": ({"fps": [25]}, {}, np.arange(6) / 25, None),
    "fps of the positions": ({}, {"positions@fps": 25}, np.arange(6) / 25, None),
}


@pytest.mark.parametrize("arrays, attrs, times, words", STATED.values(), ids=STATED)
def test_times_are_found_where_other_programs_state_them(tmp_path, arrays, attrs, times, words, recwarn):
    path = hdf5(tmp_path / "a.h5", {"positions": MOTION} | arrays, attrs)
    with athcodec.read(path) as clip:
        assert_motion(clip, times=times)
    assert [str(each.message) for each in recwarn] == ([] if words is None else [str(recwarn[0].message)])
    assert words is None or words in str(recwarn[0].message)
    recwarn.clear()
    if "time" not in arrays and not any("fps" in name for name in (*arrays, *attrs)):
        with athcodec.read(path, fps=50) as clip:  # Who states a rate is not asked.
            assert_motion(clip, times=np.arange(6) / 50)
        assert not recwarn.list


@pytest.mark.formats
def test_what_may_be_times_and_does_not_fit_is_said(tmp_path):
    path = hdf5(tmp_path / "a.h5", {"positions": MOTION, "t": np.arange(5.0), "rest": MOTION[0]})
    with pytest.warns(
        GuessWarning, match=r"t \(5,\) float64 may be times, but not one for each of 6 frames; .* 30 a second"
    ):
        athcodec.read(path).close()
    path = hdf5(tmp_path / "b.h5", {"positions": MOTION}, {"@dt": 0.04, "@sample_rate": 30})
    with pytest.raises(ClipError, match="fps: got dt 0.04, sample_rate 30, expected one rate; --fps"):
        athcodec.read(path)


@pytest.mark.formats
def test_dates_become_seconds(tmp_path):
    dates = np.datetime64("2020-01-01", "ms") + (TIMES * 1000).astype("timedelta64[ms]")
    path = npz(tmp_path / "a", {"positions": MOTION, "time": dates, "born": dates[:2]})
    with pytest.warns(SourceWarning, match="not read: array of datetime64.* born"), athcodec.read(path) as clip:
        assert_motion(clip)


@pytest.mark.formats
def test_a_unit_of_the_positions_is_that_of_the_clip(tmp_path):
    path = hdf5(tmp_path / "a.h5", {"positions": MOTION, "time": TIMES}, {"positions@units": "cm"})
    with athcodec.read(path, unit="m") as clip:
        assert np.allclose(clip.block(0, 6), MOTION / 100) and clip.metadata["unit"] == "m"


# ---- MATLAB ----

MATLAB = {"7.3": matlab73, "5": pytest.param(matlab5, marks=pytest.mark.formats)}


@pytest.mark.parametrize("write", MATLAB.values(), ids=MATLAB)
def test_matlab_files_are_read_as_matlab_shows_them(tmp_path, write):
    faces = np.stack([np.arange(1, 17), np.arange(2, 18), np.arange(3, 19)], axis=1).astype(float)
    arrays = {"positions": MOTION, "time": TIMES[:, None], "faces": faces, "unit": "cm", "radius": HEIGHT[:, None]}
    with pytest.warns(GuessWarning, match="faces: the lowest number is 1, so they were taken to be counted from 1"):
        clip = athcodec.read(write(tmp_path / "a", arrays))
    with clip:
        assert_motion(clip)
        assert np.array_equal(clip.faces, faces - 1) and clip.metadata == {"unit": "cm"}
        assert np.array_equal(clip.attributes["radius"], HEIGHT[:, None])


def test_a_file_of_older_matlab_is_read_by_scipy(tmp_path):
    path = matlab5(tmp_path / "a", {"positions": MOTION, "time": TIMES, "c": np.ones((2, 2)) > 0})
    assert find_format(path).name == "mat"
    with mat.open_clip(str(path), ReadOptions()) as clip:  # As the process of its own does, which takes longer.
        assert_motion(clip)
        assert clip.attributes.keys() == {"c"}


@pytest.mark.formats
@pytest.mark.parametrize("write", [matlab73, matlab5])
def test_structs_and_other_orders_of_matlab_are_read(tmp_path, write):
    arrays = {"positions": TURNED, "t": TIMES[None], "dt": np.array([[0.1]])}
    made = {"plant": arrays} if write is matlab5 else {f"plant/{name}": values for name, values in arrays.items()}
    path = write(tmp_path / "a", made)
    with pytest.raises(
        ClipError, match=r"plant/t has 6 rows; .*; the file has .*/plant/positions \(18, 6, 3\) float64"
    ):
        athcodec.read(path, dataset="plant")
    with pytest.warns(GuessWarning, match="plant/t was taken for the seconds"):
        with athcodec.read(path, dataset="plant", axes="vertices,frames,xyz") as clip:
            assert_motion(clip)


@pytest.mark.formats
def test_what_of_matlab_is_no_array_is_named(tmp_path):
    cell = np.empty((1, 2), object)
    cell[:] = [[np.arange(3), "a"]]
    path = matlab5(tmp_path / "a", {"positions": MOTION, "time": TIMES, "names": cell, "none": np.zeros((0, 3))})
    with pytest.warns(SourceWarning, match="cell, object or struct array names"), athcodec.read(path) as clip:
        assert clip.not_read["empty dataset"] == ["none"]
    path = matlab73(tmp_path / "b", {"positions": MOTION, "time": TIMES, "names": np.zeros((1, 2))})
    with h5py.File(path, "a") as file:
        attrs = dict(file["names"].attrs)
        del file["names"]
        file["#refs#/a"] = np.arange(3.0)
        file["names"] = np.array([file["#refs#/a"].ref] * 2, h5py.ref_dtype)
        file["names"].attrs.update(attrs)
    with athcodec.read(path) as clip:
        assert clip.not_read == {"dataset of references or lists": ["names"]} and clip.attributes == {}


@pytest.mark.formats
def test_broken_files_of_matlab_are_refused_and_named(tmp_path):
    path = matlab5(tmp_path / "a", {"positions": MOTION})
    whole = path.read_bytes()
    for data in (whole[:200], whole[:-100], b"MATLAB 5.0 MAT-file" + bytes(400)):
        path.write_bytes(data)
        with pytest.raises(ClipError, match="a.mat") as caught:
            athcodec.read(path)
        assert "\n" not in str(caught.value)


# ---- the command line ----


@pytest.mark.formats
def test_the_command_line_and_batches_have_the_options(tmp_path, capsys):
    path = hdf5(tmp_path / "a.h5", {"run/P": TURNED, "run/Q": MOTION, "run/time": TIMES})
    words = ["--dataset", "/run/P", "--axes", "vertices,frames,xyz", "--effort", "fast"]
    assert main(["encode", str(path), "-o", str(tmp_path / "a.ath"), *words]) == 0
    assert main(["verify", str(tmp_path / "a.ath"), "--against", str(path), *words[:4]]) == 0
    assert main(["batch", str(path), "--out", str(tmp_path / "out"), *words, "--workers", "1"]) == 0
    for made in ("a.ath", "out/a.ath"):
        with athcodec.open(tmp_path / made) as decoder:
            assert decoder.shape == (6, 18, 3)
    assert "each frame looks like" not in capsys.readouterr().err
    assert main(["encode", str(path), "-o", str(tmp_path / "a.ath"), "--dataset", "/run/P", "--fps", "30"]) == 1
    assert "time has 6 rows; pass --axes vertices,frames,xyz" in capsys.readouterr().err
    np.save(tmp_path / "b.npy", TURNED)
    assert main(["encode", str(tmp_path / "b.npy"), str(tmp_path / "b.ath"), "--effort", "fast"]) == 0
    assert "each frame looks like the path of one vertex; pass --axes vertices,frames,xyz" in capsys.readouterr().err
    assert main(["encode", str(path), "-o", str(tmp_path / "a.ath")]) == 1
    assert "/run/P (18, 6, 3) float64" in capsys.readouterr().err


@pytest.mark.formats
def test_a_store_of_zarr_and_netcdf_3_say_what_to_do(tmp_path):
    (tmp_path / "a.zarr").mkdir()
    (tmp_path / "a.zarr" / "zarr.json").write_text("{}")
    with pytest.raises(ClipError, match="is a zarr store, .* athcodec.encode takes one of its arrays"):
        athcodec.read(tmp_path / "a.zarr")
    (tmp_path / "a.nc").write_bytes(b"CDF\1" + bytes(99))
    with pytest.raises(ClipError, match="nccopy -k nc4"):
        athcodec.read(tmp_path / "a.nc")
