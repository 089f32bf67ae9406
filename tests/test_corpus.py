"""Every input that once went wrong, and what must come of it now. Files that are small are kept in corpus/.

An .ath file there is used through Python and by all fuzz targets; one that is named after a target is that target's own
input. A find without a test here is a failure.
"""

from __future__ import annotations

from io import BytesIO
from pathlib import Path

import numpy as np
import pytest
from fuzz import targets
from hostile_files import colliding_gaps, random_gaps, segments_of_one_frame, stems_with_gaps
from test_damage import use

import athcodec
from athcodec.decoding import core_file

CORPUS = Path(__file__).resolve().parent / "corpus"
TESTED = {"colliding_gaps.ath", "connected_rest_without_faces.player", "integers_not_yet_written.prelude"}


def test_every_find_has_a_test():
    assert {path.name for path in CORPUS.iterdir()} == TESTED


@pytest.mark.parametrize("path", sorted(CORPUS.glob("*.ath")), ids=lambda path: path.stem)
def test_every_file_plays(path):
    assert use(path.read_bytes())


@pytest.mark.tools
@pytest.mark.parametrize("target", targets.TARGETS)
def test_every_input_goes_through_the_targets(target):
    paths = sorted([*CORPUS.glob("*.ath"), *CORPUS.glob(f"*.{target}")])
    outcome = targets.replay(target, targets.build(target, targets.compiler()), paths)
    assert outcome.kind == "", outcome.log


def test_stems_whose_gaps_collide_are_opened_with_hardly_more_work_than_others(work_of):
    """Stems with gaps of one hash were each compared with all before them: 40,000 took 7 s, and twice as many four
    times as long."""
    others = random_gaps(np.random.default_rng(0), 4_000, 10)
    first, second = (
        work_of(lambda data=stems_with_gaps(gaps): athcodec.open(BytesIO(data)))
        for gaps in (colliding_gaps(4_000), others)
    )
    assert first < 1.5 * second


def test_what_collides_has_the_bases_that_it_would_have_alone():
    """After some probes a piece no longer looks for one like itself; it must decode to the same."""
    rows = random_gaps(np.random.default_rng(2), 3, 10)
    decoder = athcodec.open(BytesIO(stems_with_gaps(rows)))
    assert np.array_equal(decoder.positions(0)[1:, 0], np.cumsum(rows, axis=1).ravel())


def test_the_work_of_playing_segments_is_proportional_to_their_number(work_of):
    """Decoder.blocks went over all segments for each: 16,000 took 200 s."""

    def play(data: bytes) -> None:
        for _ in athcodec.open(BytesIO(data)).blocks():
            pass

    short, long = (work_of(lambda data=segments_of_one_frame(count): play(data)) for count in (100, 800))
    assert long < 1.2 * 8 * short


def test_the_bytes_of_a_segment_are_found_without_looking_at_those_of_others(work_of):
    """ath_ranges looked at every chunk of the file, for each segment that was asked for."""

    def ask(count: int) -> int:
        decoder = athcodec.open(BytesIO(segments_of_one_frame(count)))
        core: core_file.File = decoder.file.core
        return work_of(lambda: [core.missing(1, segment) for segment in range(0, count, count // 250)])

    assert ask(8_000) < 2 * ask(250), "32 times the chunks"


@pytest.mark.tools
def test_integers_are_not_looked_at_before_they_are_written():
    """The permutation of the vertices entered a sum before it was decoded, which overflowed where memory held the least
    integer. The target prelude.c fills it with that, under a sanitizer: the test above on all inputs runs it."""
    path = CORPUS / "integers_not_yet_written.prelude"
    program = targets.build("prelude", targets.compiler())
    assert targets.replay("prelude", program, [path]).kind == ""
