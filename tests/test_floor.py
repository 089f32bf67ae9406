"""Plants of the forest's floor: the samples, how they move, and where pages put them."""

from __future__ import annotations

import base64
import re

import numpy as np
import pytest

import athcodec
from athcodec import cli
from athcodec.viewer import view
from bench.throttled_server import ThrottledServer
from bench.trees.tufts import fern, grass

pytestmark = pytest.mark.web

FLOOR = ["fern", "grass"]
MAKERS = {
    "fern": lambda seed=7: fern(12, 6, 0.8, 20, {"calm": 2.5, "gale": 10.0}, seed, 30.0),
    "grass": lambda seed=5: grass(70, 0.45, 20, {"calm": 2.5, "gale": 10.0}, seed, 30.0),
}


@pytest.fixture(scope="module", params=FLOOR)
def plant(request):
    return request.param, MAKERS[request.param]()


@pytest.mark.parametrize("name", FLOOR)
def test_the_samples_are_small_loops_in_two_winds_with_surfaces(name):
    path = athcodec.sample_path(name)
    assert path.stat().st_size < 60_000
    with athcodec.open(path, strict=True) as decoder:
        assert [(clip.name, clip.loop, clip.frame_count) for clip in decoder.file.clips] == [
            ("calm", True, 150),
            ("gale", True, 150),
        ]
        metadata = decoder.file.metadata
        assert 300 < decoder.file.vertex_count <= 3000
    assert metadata["surfaces"] == {"fern": "stalks, pinnae", "grass": "stalks, blades"}[name]
    assert [metadata["clips"][clip]["strength"] for clip in ("calm", "gale")] == [2.5, 10.0]


def test_a_gale_moves_what_a_calm_wind_hardly_does_and_nothing_goes_under_ground(plant):
    name, clip = plant
    calm, gale = (part.block(0, 20) for part in athcodec.split(clip).values())
    away = [np.linalg.norm(part - clip.rest, axis=2).max() for part in (calm, gale)]
    assert 0 < 3 * away[0] < away[1] < {"fern": 0.8, "grass": 0.45}[name]
    assert min(calm[..., 1].min(), gale[..., 1].min()) > -0.02


def test_blades_pinnae_and_stems_stay_as_wide_as_they_are(plant):
    _, clip = plant
    edges = clip.faces[:, [0, 1]]
    ends = np.concatenate([clip.rest[None], clip.block(0, clip.frame_count)])[:, edges].astype(np.float64)
    length = np.linalg.norm(ends[:, :, 0] - ends[:, :, 1], axis=2)
    assert np.abs(length[1:] - length[0]).max() < 1e-5


def test_texture_coordinates_tell_stems_from_leaves(plant):
    name, clip = plant
    u, v = clip.attributes["uv"].T
    leaf = u >= 1
    assert leaf.all() if name == "grass" else 0 < leaf.sum() < len(leaf)
    assert set(np.unique(u[leaf] % 2)) == {0.0, 1.0} and u.max() <= 16 and (v[leaf] <= 1).all()


@pytest.mark.slow
@pytest.mark.parametrize("name", FLOOR)
def test_the_same_seed_makes_the_same_plant(name):
    first, again, other = MAKERS[name](), MAKERS[name](), MAKERS[name](seed=99)
    assert np.array_equal(first.block(0, 40), again.block(0, 40))
    assert not np.array_equal(first.rest, other.rest)


def inside(page: str) -> list[tuple[float, bytes]]:
    found = re.findall(r'class="ath-floor" data-each="([^"]*)">([^<]*)<', page)
    return [(float(each), base64.b64decode(data)) for each, data in found]


def test_the_page_of_the_demo_has_fern_and_grass_for_its_forest(tmp_path):
    assert cli.main(["demo", "--keep", str(tmp_path)]) == 0
    floor = inside((tmp_path / "athcodec_demo.html").read_text("utf-8"))
    assert [data for _, data in floor] == [athcodec.sample_path(name).read_bytes() for name in FLOOR]
    assert all(each >= 1 for each, _ in floor)


def test_a_page_takes_plants_for_its_floor_with_how_many_of_each(sample_ath, tmp_path, capsys):
    fern = athcodec.sample_path("fern")
    page = tmp_path / "page.html"
    command = ["view", str(sample_ath), "--export", str(page), "--floor", f"{fern}=2.5", "--floor", str(sample_ath)]
    assert cli.main(command) == 0
    assert inside(page.read_text("utf-8")) == [(2.5, fern.read_bytes()), (4.0, sample_ath.read_bytes())]
    (tmp_path / "no.ath").write_bytes(b"nothing of the kind")
    assert cli.main([*command[:4], "--floor", str(tmp_path / "no.ath")]) == 1
    with pytest.raises(SystemExit):
        cli.main([*command[:4], "--floor", f"{fern}=-1"])


PLANTED = """() => athcodecViewer.forests().map((forest) => ({
  count: forest.count, drawn: forest.counts.reduce((a, b) => a + b, 0) + forest.culled, levels: forest.baked.length
}))"""


@pytest.mark.browser
def test_fern_and_grass_stand_between_the_trees_of_a_page(opened, sample_ath, tmp_path):
    page_file = tmp_path / "page.html"
    floor = {athcodec.sample_path("fern"): 2.0, athcodec.sample_path("grass"): 3.0}
    view.export_page(sample_ath, page_file, floor=floor)
    page = opened(page_file.as_uri())
    assert page.evaluate("athcodecViewer.forests().length") == 0
    page.evaluate("athcodecViewer.forestOf(20)")
    page.wait_for_function(f"() => ({PLANTED})().filter(({{ levels }}) => levels > 0).length === 3")
    page.wait_for_function(f"() => ({PLANTED})().every(({{ count, drawn }}) => count === drawn)")
    assert [each["count"] for each in page.evaluate(PLANTED)] == [20, 40, 60]
    page.evaluate("athcodecViewer.forestSwitch(false)")
    assert page.evaluate("athcodecViewer.forests().length") == 0
    assert (
        page.evaluate("athcodecViewer.stage.panes[0].scene.children.filter(({ type }) => type === 'Group').length") == 2
    )
    page.evaluate("athcodecViewer.forestSwitch(true)")
    page.wait_for_function("() => athcodecViewer.forests().length === 3")


@pytest.mark.browser
def test_an_address_opens_a_forest_with_a_floor(opened, sample_ath):
    files = {"tree.ath": sample_ath.read_bytes(), "grass.ath": athcodec.sample_path("grass").read_bytes()}
    with ThrottledServer(files) as line:
        address = line.page("tree.ath", floor="/grass.ath", each="3")
        page = opened(f"{address}#forest=30", "athcodecViewer.forests().length === 2")
        assert [each["count"] for each in page.evaluate(PLANTED)] == [30, 90]
        assert page.is_checked("#forest")


@pytest.mark.browser
def test_without_the_floor_s_file_the_trees_stand_alone(opened, sample_ath):
    with ThrottledServer({"tree.ath": sample_ath.read_bytes(), "none.ath": b"nothing of the kind"}) as line:
        page = opened(
            f"{line.page('tree.ath', floor='/none.ath')}#forest=30", "athcodecViewer.forests()[0]?.count === 30"
        )
        page.wait_for_function("() => athcodecViewer.forests()[0].baked.length > 0")
        assert page.evaluate("athcodecViewer.forests().length") == 1
