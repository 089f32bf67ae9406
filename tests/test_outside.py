"""Sources that name files outside of their own folder: refused, unless the caller allows it."""

from __future__ import annotations

import os
import shutil
from collections.abc import Callable
from functools import partial
from pathlib import Path

import h5py
import numpy as np
import pytest
from plants import chain_plant

import athcodec
from athcodec.cli import main
from athcodec.errors import ClipError

pytestmark = pytest.mark.formats


@pytest.fixture(scope="module")
def folder(tmp_path_factory) -> Path:
    """A plant in every format that a source can name other files in."""
    made = tmp_path_factory.mktemp("outside")
    athcodec.encode(chain_plant(3, 10), made / "tree.ath", rel_error=1e-2)
    for name in ("tree.xdmf", "tree.pvd", "tree.h5", "tree.usda"):
        (made / name.replace(".", "_")).mkdir()
        assert main(["decode", str(made / "tree.ath"), str(made / name.replace(".", "_") / name)]) == 0
    return made


def moved(folder: Path, tmp_path: Path, name: str, others: str, absolute: bool) -> Path:
    """The source in a folder of its own, and the files that it names in another."""
    own, away = tmp_path / "own", tmp_path / "away"
    shutil.copytree(folder / name.replace(".", "_"), own)
    away.mkdir()
    text = (own / name).read_text("utf-8")
    for file in sorted(own.glob(others)):
        file.rename(away / file.name)
        text = text.replace(file.name, f"{away if absolute else '../away'}/{file.name}")
    (own / name).write_text(text, "utf-8")
    return own / name


def usd(folder: Path, tmp_path: Path) -> Path:
    away = Path(shutil.copytree(folder / "tree_usda", tmp_path / "away")) / "tree.usda"
    stage = tmp_path / "own" / "stage.usda"
    stage.parent.mkdir()
    stage.write_text(
        f"#usda 1.0\n(\n    subLayers = [@{away}@]\n    startTimeCode = 0\n    endTimeCode = 9\n"
        "    timeCodesPerSecond = 30\n)\n",
        "utf-8",
    )
    return stage


def linked(folder: Path, tmp_path: Path) -> Path:
    away, own = tmp_path / "away.h5", tmp_path / "own" / "tree.h5"
    shutil.copy(folder / "tree_h5" / "tree.h5", away)
    own.parent.mkdir()
    with h5py.File(away) as source, h5py.File(own, "w") as file:
        file.attrs.update(source.attrs)
        for name in source:
            file[name] = h5py.ExternalLink(str(away), name)
    return own


def stored_elsewhere(folder: Path, tmp_path: Path) -> Path:
    own, away = tmp_path / "own" / "tree.h5", tmp_path / "numbers.raw"
    own.parent.mkdir()
    shutil.copy(folder / "tree_h5" / "tree.h5", own)
    with h5py.File(own, "a") as file:
        positions = file["positions"][...]
        positions.tofile(away)
        del file["positions"]
        shape, dtype = positions.shape, positions.dtype
        file.create_dataset("positions", shape, dtype, external=[(str(away), 0, positions.nbytes)])
    return own


def virtual(folder: Path, tmp_path: Path) -> Path:
    own, away = tmp_path / "own" / "tree.h5", tmp_path / "away.h5"
    own.parent.mkdir()
    shutil.copy(folder / "tree_h5" / "tree.h5", own)
    shutil.copy(own, away)
    with h5py.File(own, "a") as file:
        layout = h5py.VirtualLayout(file["positions"].shape, file["positions"].dtype)
        layout[...] = h5py.VirtualSource(str(away), "positions", file["positions"].shape)
        del file["positions"]
        file.create_virtual_dataset("positions", layout)
    return own


MAKERS: dict[str, Callable[[Path, Path], Path]] = {
    "xdmf": partial(moved, name="tree.xdmf", others="*.h5", absolute=False),
    "xdmf, absolute": partial(moved, name="tree.xdmf", others="*.h5", absolute=True),
    "pvd": partial(moved, name="tree.pvd", others="*.vtu", absolute=True),
    **{maker.__name__: maker for maker in (usd, linked, stored_elsewhere, virtual)},
}


@pytest.mark.parametrize("maker", MAKERS.values(), ids=MAKERS)
def test_files_elsewhere_are_read_only_where_that_is_allowed(maker, folder, tmp_path, capsys):
    path = maker(folder, tmp_path)
    with pytest.raises(ClipError, match="allow-outside"):
        athcodec.read(path)
    with athcodec.read(path, allow_outside=True) as clip:
        assert clip.vertex_count == 3 * 10 and np.isfinite(clip.block(0, 2)).all()
    assert main(["encode", str(path), "-o", str(tmp_path / "out.ath"), "--rel-error", "1e-2"]) == 1
    assert "--allow-outside" in capsys.readouterr().err
    words = ["encode", str(path), "-o", str(tmp_path / "out.ath"), "--rel-error", "1e-2", "--allow-outside"]
    assert main(words) == 0


def test_a_link_within_the_file_and_groups_that_hold_each_other_are_no_matter(folder, tmp_path):
    path = tmp_path / "tree.h5"
    shutil.copy(folder / "tree_h5" / "tree.h5", path)
    with h5py.File(path, "a") as file:
        file["more/inner"] = np.arange(3)
        file["more/again"] = file["more"]
        file["other"] = h5py.SoftLink("/more/inner")
    with athcodec.read(path) as clip:
        assert clip.attributes["more/inner"].tolist() == [0, 1, 2]


@pytest.mark.parametrize("suffix", [".xdmf", ".pvd"])
def test_what_is_no_plain_file_is_not_read(suffix, folder, tmp_path):
    name = f"tree{suffix}"
    path = moved(folder, tmp_path, name, "*.nothing", absolute=True)
    others = sorted(path.parent.glob("*.h5" if suffix == ".xdmf" else "*.vtu"))
    others[0].unlink()
    others[0].mkdir()
    with pytest.raises(ClipError, match="plain file"):
        athcodec.read(path)


def test_a_pipe_that_a_stage_names_is_refused_before_it_is_opened(tmp_path):
    os.mkfifo(tmp_path / "layer.usda")
    (tmp_path / "stage.usda").write_text("#usda 1.0\n(\n    subLayers = [@./layer.usda@]\n)\n", "utf-8")
    with pytest.raises(ClipError, match="expected a plain file"):
        athcodec.read(tmp_path / "stage.usda")
