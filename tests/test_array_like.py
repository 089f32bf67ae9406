"""A decoder is an array that can be read: NumPy's operators, functions and methods, and copies in other processes."""

from __future__ import annotations

import copy
import io
import pickle

import fsspec
import numpy as np
import pytest
from plants import plant

import athcodec
from athcodec.decoding.container import Limits
from athcodec.errors import BadChecksum

GRASS = athcodec.sample_path("grass")


@pytest.fixture(scope="module")
def grass():
    with athcodec.open(GRASS, clip="gale") as decoder:
        yield decoder


@pytest.fixture(scope="module")
def whole(grass):
    return np.stack([grass.positions(frame) for frame in range(len(grass))])


EXPRESSIONS = """
a == "calm"; a != None; a == None; other != a; None == a
a * 2; 2 * a; a - a; a + other; other + a; -a; abs(a); a ** 2; a // 0.1; a % 0.1; divmod(a, 0.1); a @ turn
a * [1, 2, 3]; a == a; a != other; a < 0.1; a >= other; (a > 0) & (a < 0.1); other == a; np.float64(2) * a; a.T
a.mean(); a.mean(axis=0); a.min(); a.max(axis=(0, 1)); a.std(0); a.var(); a.sum(2); a.prod(); a.argmax()
a.argmin(1); a.astype("f8"); a.astype(np.float16, copy=False); a.reshape(-1, 3); a.ravel(); a.flatten()
a.transpose(1, 0, 2); a.copy(); a.swapaxes(0, 1); a.squeeze(); a.take([0, 2], axis=1); a.round(2); a.cumsum(0)
a.any(); a.all(axis=2); a.item(7); a.repeat(2, axis=2); a.dot(turn); a.tobytes(); a.view("i4"); a.trace()
a.diagonal(); a.searchsorted; np.mean(a, axis=0); np.max(a); np.std(a, (0, 1)); np.clip(a, 0, 0.1)
np.concatenate([a, a]); np.stack([a, other]); np.where(a > 0, a, 0); np.linalg.norm(a, axis=2); np.diff(a, axis=0)
np.einsum("tvc->tc", a); np.add.reduce(a); np.sin(a); np.maximum.accumulate(a); np.subtract.outer(a[0, 0], a[0, 1])
np.percentile(a, 50); np.moveaxis(a, 0, 1); np.zeros_like(a); np.shape(a); np.ndim(a); np.size(a); np.array(a)
np.copy(a); np.asarray(a, dtype="f4"); np.broadcast_to(a, (2, *a.shape)); np.multiply(a, 2, dtype="f8")
np.isfinite(a); np.vstack([a, a]); np.array_equal(a, other); np.allclose(a, a); a.shape; a.dtype; a.ndim; a.size
a.nbytes; a.itemsize; len(a); sum(a); list(a)[3]; list(reversed(a))[3]; max(a[0, :, 0]); a[...]; a[::-1]
a[100:2:-7, ::-2, 0]; a[-1]; a[None]; a[[1, 2], [3, 4]]; a[a > 0]; a[5, ..., 1]; a[:, [0, 1]]; a[()]; 0.0 in a
1e9 in a; a[3, 2, 1] in a
"""


@pytest.mark.parametrize(
    "expression", [text.strip() for text in EXPRESSIONS.replace("\n", ";").split(";") if text.strip()]
)
def test_numpy_makes_the_same_of_a_decoder_as_of_the_array_that_it_decodes_to(expression, grass, whole):
    names = {"np": np, "other": whole[::-1] * 0.5, "turn": np.eye(3, dtype=np.float32)[::-1]}
    of_decoder, of_array = (eval(expression, names | {"a": array}) for array in (grass, whole))
    if expression == "a.searchsorted":
        of_decoder, of_array = of_decoder.__doc__, of_array.__doc__
    if expression == "np.zeros_like(a)" or isinstance(of_array, np.ndarray):
        assert type(of_decoder) is np.ndarray and of_decoder.dtype == of_array.dtype
    assert type(of_decoder) is type(of_array)
    assert np.array_equal(of_decoder, of_array)


def test_a_decoder_is_read_only_and_says_so(grass, whole):
    decoder = grass
    with pytest.raises(TypeError, match="out: got a Decoder, which is read-only; expected an array"):
        decoder += 1
    with pytest.raises(TypeError, match="read-only"):
        np.add(whole, 1, out=grass)
    with pytest.raises(TypeError, match="item assignment"):
        grass[0] = 1
    out = np.empty_like(whole)
    assert np.add(grass, 1, out=out) is out and np.array_equal(out, whole + 1)
    for name in ("sort", "fill", "strides", "flags", "resize", "partition"):
        with pytest.raises(AttributeError, match=f"'Decoder' object has no attribute '{name}'; np.asarray of it has"):
            getattr(grass, name)
    with pytest.raises(AttributeError, match="no attribute 'men'$"):
        _ = grass.men
    with pytest.raises(TypeError, match="unhashable"):
        hash(grass)
    assert grass.clip.name == "gale" and {"mean", "T", "nbytes", "astype"} <= set(dir(grass))


def test_what_is_asked_about_an_array_decodes_nothing():
    with athcodec.open(GRASS) as grass:
        before = grass.file.bytes_read
        _ = grass.shape, grass.dtype, grass.ndim, grass.size, grass.nbytes, len(grass), grass.mean, grass.astype
        assert not hasattr(grass, "__array_interface__") and not hasattr(grass, "__array_function__")
        assert grass.file.bytes_read == before
        assert grass.mean() == grass.mean() and grass.file.bytes_read > before


def test_an_array_of_another_package_decides_what_becomes_of_both(grass, whole):
    class Logged(np.lib.mixins.NDArrayOperatorsMixin):
        def __array_ufunc__(self, ufunc, method, *inputs, **options):
            return ufunc, [type(value) for value in inputs]

    assert grass - Logged() == (np.subtract, [np.ndarray, Logged])
    assert (Logged() * grass)[0] is np.multiply
    masked = np.ma.masked_less(whole, 0)
    assert isinstance(masked - grass, np.ma.MaskedArray) and (masked - grass).count() == masked.count()


# ---- copies, in this process and in others ----


def way(kind: str, folder, monkeypatch):
    """The grass as `open` takes it."""
    if kind == "relative path":
        (folder / "grass.ath").write_bytes(GRASS.read_bytes())
        monkeypatch.chdir(folder)
        return "grass.ath"
    if kind == "URL":
        fsspec.filesystem("memory").pipe("/grass.ath", GRASS.read_bytes())
        return "memory://grass.ath"
    return {"path": GRASS, "bytes": GRASS.read_bytes(), "buffer": memoryview(bytearray(GRASS.read_bytes()))}[kind]


@pytest.mark.parametrize("kind", ["path", "relative path", "URL", "bytes", "buffer"])
def test_a_decoder_of_a_path_url_or_bytes_comes_back_from_a_pickle_at_its_clip_and_level(kind, tmp_path, monkeypatch):
    with athcodec.open(way(kind, tmp_path, monkeypatch), clip="gale", limits=Limits(vertices=1400)) as gale:
        pickles = [pickle.dumps([gale, gale.at_level(1), gale.play("calm")], protocol) for protocol in (2, 5)]
        monkeypatch.chdir("/")
        for data in pickles:
            for again, decoder in zip(pickle.loads(data), (gale, gale.at_level(1), gale.play("calm"))):
                assert (again.clip, again.level, repr(again)) == (decoder.clip, decoder.level, repr(decoder))
                assert np.array_equal(again, decoder) and again.file.limits.vertices == 1400
        first, second, _ = pickle.loads(pickles[0])
        assert first.file is second.file is not gale.file
        first.close()
        assert second.file.is_closed and not gale.file.is_closed
        assert np.array_equal(gale[3], gale.at_level(None)[3])
        assert len(pickles[1]) < (60_000 if kind in ("bytes", "buffer") else 1000)


def test_views_files_and_copies_of_decoders_are_as_they_were(grass):
    view = athcodec.ClipView(grass, 1, range(20, 60))
    again, file = pickle.loads(pickle.dumps((view, grass.file)))
    assert again.decoder.file is file and (again.level, again.frame_count) == (1, 40)
    assert np.array_equal(again.positions[:], view.positions[:]) and np.array_equal(again.time, view.time)
    for twin in (copy.copy(grass), copy.deepcopy(grass), copy.deepcopy(grass.at_level(2))):
        assert twin.clip.name == "gale" and np.array_equal(twin[::50], grass.at_level(twin.level)[::50])
    assert copy.copy(grass).file is grass.file is not copy.deepcopy(grass).file


def test_a_decoder_whose_rest_pose_a_host_has_takes_it_along(tmp_path):
    clip = plant(seed=5, branches=4, frames=12)
    path = athcodec.encode(clip, tmp_path / "a.ath", host_rest=True, effort="fast").path
    with athcodec.open(path, host_mesh=clip.rest.astype(np.float32)) as hosted, athcodec.open(path) as bare:
        assert np.array_equal(pickle.loads(pickle.dumps(hosted)), hosted)
        assert pickle.loads(pickle.dumps(bare)).file.needs_host_mesh


def test_what_cannot_be_opened_again_says_why(tmp_path):
    path = tmp_path / "a.ath"
    path.write_bytes(GRASS.read_bytes())
    for file in (io.BytesIO(GRASS.read_bytes()), open(path, "rb")):
        with file, athcodec.open(file) as decoder, pytest.raises(TypeError, match="got one of a file object.* bytes"):
            pickle.dumps(decoder)
    decoder = athcodec.open(path)
    pickled = pickle.dumps(decoder)
    decoder.close()
    with pytest.raises(ValueError, match="is closed; expected an open file"):
        pickle.dumps(decoder)
    athcodec.truncate(GRASS, path, 1)
    with pytest.raises(BadChecksum, match="a.ath: got another file than the one that was pickled; open it again"):
        pickle.loads(pickled)
    path.unlink()
    with pytest.raises(FileNotFoundError, match="a.ath"):
        pickle.loads(pickled)
