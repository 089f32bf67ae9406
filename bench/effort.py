"""The order in which the encoder makes its choices: learned on clips of some makers, judged on those of the others.

A choice saves bytes and takes counted work. On the clips of one half of the makers the order is built from nothing: at
each place stands the choice that then saves most for its work, over all of these clips. Files in that order and in the
encoder's (athcodec/encoding/search/order.py) are compared on both halves, and with those of effort "best". Every figure
is stored as it is measured, and is not measured again.
"""

from __future__ import annotations

import argparse
import io
import math
import sys
import time
import warnings
from collections.abc import Iterable, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from statistics import mean
from typing import Any
from unittest.mock import patch

import athcodec
from athcodec.encoding.search import order
from athcodec.encoding.search.progress import allowed_work
from athcodec.encoding.search.search import BY_NAME, Search, settled
from athcodec.encoding.search.trials import Trials
from athcodec.encoding.segments.settings import Settings
from bench.clips import POSITIONS, add_rel_error
from bench.store import Store
from bench.suite import Case, cases
from bench.tables import environment, table

RESULTS = Path(__file__).parent / "results" / "effort.json"
KEYS = {"choices": ("clip", "bound", "done", "choice"), "files": ("clip", "bound", "order", "effort")}
# Clips by maker, small ones, in two halves. None is held out.
LEARNING = {
    "Blender": ("blender_bent_grass", "blender_cloth_leaf"),
    "CPlantBox": ("cplantbox_brassica", "cplantbox_maize"),
    "L-systems": ("lsystem_fern",),
    "scikit-fem": ("skfem_leaf",),
    "formulas": ("cards_373x121f", "scanned", "sheet", "teleport"),
}
JUDGING = {
    "beams": ("sample", "canopy_4k_60f", "calm"),
    "Helios": ("helios_rice_8d", "helios_rice_20d"),
    "MuJoCo": ("mujoco_cable_grass", "mujoco_cable_vine"),
    "shaders": ("shader_card_tree",),
    "scanned skeletons": ("scan_skeleton_tree",),
    "morph targets": ("morph",),
}
# Choices that stand between both parts of the order.
STEPS = ("best_pieces_in_any_basis", "best_steps", "learned_about_other_pose")
LEAST_SHARE = 1e-6  # Share of the work allowed below which a choice counts as not made.
USUAL, MOST = 1.02, 1.05  # Bytes, over those of effort "best", of 95 % of all clips, and of every one.

ORDER_NOTE = """
The order that the learning half asks for, choice after choice. Saves: per cent of the bytes that are left when its turn
comes; work: per cent of what an encoding may take; both are means over the clips of a half, without a limit of work.
"""
FILES_NOTE = f"""
Bytes of positions alone in one layer. Seconds: of the processor. Best: bytes of effort "best"; default / best: at most
{USUAL:g} on 95 % of all clips, {MOST:g} on every one. Untried: what the encoder's order left out for want of work.
"""
HALVES_NOTE = "Means of ratios of bytes."

Order = tuple[tuple[str, ...], tuple[str, ...]]


def add_arguments(parser: argparse.ArgumentParser) -> None:
    parser.add_argument("--learning", nargs="+", metavar="CLIP", help="clips that the order is learned on")
    parser.add_argument("--judging", nargs="+", metavar="CLIP", help="clips that the order is judged on")
    parser.add_argument("--results", type=Path, default=RESULTS, metavar="FILE", help="where figures are kept")
    add_rel_error(parser)


def run(args: argparse.Namespace) -> dict[str, Any]:
    """Learn the order of the encoder's choices that saves most bytes for its work on one half of the clips, and judge
    it on the other half. Return tables of the learned order and of the resulting files.
    """
    warnings.simplefilter("ignore")  # Bounds and units are those of the clips; every run would warn of them again.
    halves = {"learning": _cases(args.learning, LEARNING), "judging": _cases(args.judging, JUDGING)}
    store = Store(args.results, environment(args.argv), KEYS)
    learner = _Learner(store, args.rel_error)
    learned = learner.learned(halves["learning"])
    learner.follow(halves["judging"], learned)
    of_encoder = order.BEFORE_STEPS, order.AFTER_STEPS
    for effort, one in (("default", of_encoder), ("default", learned), ("best", of_encoder)):
        for case in [*halves["learning"], *halves["judging"]]:
            _measure_file(store, case, args.rel_error, one, effort)
    files = {half: _file_rows(store, chosen, args.rel_error, of_encoder, learned) for half, chosen in halves.items()}
    tables = [
        table("Order learned", _order_rows(store, halves, args.rel_error, learned), ORDER_NOTE),
        table("Halves", [{"half": half} | _summary(rows) for half, rows in files.items()], HALVES_NOTE),
        *(table(f"Files of the {half} half", rows, FILES_NOTE) for half, rows in files.items()),
    ]
    return {"tables": tables, "broken": []}


def _cases(words: Sequence[str] | None, usual: Mapping[str, Sequence[str]]) -> list[Case]:
    chosen = cases(words or [name for names in usual.values() for name in names], "quick")
    return [case for case in chosen if case.path is not None]


class _Searching(Exception):
    """The search for settings has begun; it carries the search."""


@dataclass
class _State:
    """What is known about one clip after some choices."""

    name: str
    trials: Trials
    settings: Settings
    allowed: float  # Work that an encoding of the clip may take.
    is_small: bool  # Whether all choices are made again, as in small clips.

    def after(self, name: str) -> tuple[_State, dict[str, float]]:
        """Return the state of the search after the choice `name` is made as well, and the figures of that choice: the
        file's cost "before" and "after", and the "share" of the allowed work that it took.
        """
        trials = self.trials.apart()
        before = trials.cost(self.settings)
        if name == settled.__name__ and not self.is_small:
            settings = self.settings
        else:
            settings = BY_NAME[name](self.settings, trials)
        figures = {
            "before": round(before, 1),
            "after": round(trials.cost(settings), 1),
            "share": round(trials.work.done / self.allowed, 6),
        }
        return _State(self.name, trials, settings, self.allowed, self.is_small), figures


class _Learner:
    """Builds the order of choices, and stores what each saves and takes."""

    def __init__(self, store: Store, rel_error: float):
        self._store, self._rel_error = store, rel_error

    def learned(self, clips: Sequence[Case]) -> Order:
        """Return the order of the encoder's choices in which each next choice saves most bytes for its work, averaged
        over `clips`.
        """
        with ExitStack() as stack:
            states, done = self._first_states(clips, stack), ()
            first, states = self._best_order(order.BEFORE_STEPS, states, done)
            for name in STEPS:
                states = self._applied(states, (*first, *STEPS[: STEPS.index(name)]), name)
            last, _ = self._best_order(order.AFTER_STEPS, states, (*first, *STEPS))
        return first, last

    def follow(self, clips: Sequence[Case], learned: Order) -> None:
        """Store what choices save and take on other clips in an order that is known."""
        names = (*learned[0], *STEPS, *learned[1])
        with ExitStack() as stack:
            states = self._first_states(clips, stack)
            for number, name in enumerate(names):
                states = self._applied(states, names[:number], name)

    def _best_order(
        self, names: Sequence[str], states: list[_State], done: tuple[str, ...]
    ) -> tuple[tuple[str, ...], list[_State]]:
        """Order the choices `names` so that each next choice saves most bytes for its work. Return that order, and the
        states of the clips after all of them; `done` has the choices made before.
        """
        left, chosen = list(names), ()
        while left:
            tried = {name: self._applied(states, done + chosen, name) for name in left}
            best = max(left, key=lambda name: self._rate(states, done + chosen, name))  # Of equals the first of before.
            states, chosen = tried[best], (*chosen, best)
            left.remove(best)
        return chosen, states

    def _first_states(self, clips: Sequence[Case], stack: ExitStack) -> list[_State]:
        states = (
            _first_state(stack.enter_context(athcodec.read(case.path)), case.name, self._rel_error) for case in clips
        )
        return [state for state in states if state is not None]

    def _applied(self, states: list[_State], done: tuple[str, ...], name: str) -> list[_State]:
        """Return the states of all clips after the choice `name`, made after the choices in `done`, and store the
        figures of that choice for each clip.
        """
        others = []
        for state in states:
            other, figures = state.after(name)
            key = {"clip": state.name, "bound": self._rel_error, "done": " ".join(done), "choice": name}
            if self._store.find("choices", key) is None:
                self._store.add("choices", key | figures)
            others.append(other)
        means = _means(self._store, [state.name for state in states], self._rel_error, done, name)
        print(f"{' '.join(done)} + {name}: {means}", file=sys.stderr, flush=True)
        return others

    def _rate(self, states: list[_State], done: tuple[str, ...], name: str) -> float:
        saved, share = _means(self._store, [state.name for state in states], self._rel_error, done, name)
        return saved / share if share > LEAST_SHARE else 0.0


def _first_state(clip: athcodec.MotionClip, name: str, rel_error: float) -> _State | None:
    """Return the state in which the search for a clip's settings begins, or None if the clip's file needs no search."""

    def noted(search: Search) -> None:
        raise _Searching(search)

    with patch.object(Search, "decide", noted):
        try:
            athcodec.encode(clip, io.BytesIO(), rel_error=rel_error, **POSITIONS)
        except _Searching as captured:
            search: Search = captured.args[0]
            tried = search.of_sample or search
            allowed = allowed_work(clip.vertex_count, clip.frame_count, "default")
            return _State(name, tried.trials.apart(), tried.trials.start, allowed, search.makes_all_again)
    return None


def _means(store: Store, clips: Iterable[str], rel_error: float, done: Sequence[str], name: str) -> tuple[float, float]:
    """Return the mean saving of a choice, as the logarithm of bytes, and the mean share of the work allowed."""
    keys = ({"clip": clip, "bound": rel_error, "done": " ".join(done), "choice": name} for clip in clips)
    rows = [row for key in keys if (row := store.find("choices", key)) is not None]
    if not rows:
        return 0.0, 0.0
    return mean(math.log(row["before"] / row["after"]) for row in rows), mean(row["share"] for row in rows)


def _measure_file(store: Store, case: Case, rel_error: float, one: Order, effort: str) -> None:
    """Encode a clip with the choices in the order `one` and store the bytes and seconds of its file. `effort` is the
    encoder's effort, "default" or "best".
    """
    key = {"clip": case.name, "bound": rel_error, "order": _text(one), "effort": effort}
    if store.find("files", key) is not None:
        return
    with patch.multiple(order, BEFORE_STEPS=one[0], AFTER_STEPS=one[1]), athcodec.read(case.path) as clip:
        start = time.process_time()
        summary = athcodec.encode(clip, io.BytesIO(), rel_error=rel_error, effort=effort, **POSITIONS)
        seconds = round(time.process_time() - start, 2)
    figures = {"bytes": summary.bytes, "seconds": seconds, "untried": list(summary.untried)}
    print(store.add("files", key | figures), file=sys.stderr, flush=True)


def _text(one: Order) -> str:
    return "; ".join(" ".join(names) for names in one)


def _order_rows(store: Store, halves: Mapping[str, list[Case]], rel_error: float, learned: Order) -> list[dict]:
    """Return the rows of a table of the search's choices, one for each choice in the learned order. A row has, for each
    half of the clips, two averages over its clips: by how many per cent the choice makes the files smaller when all
    choices before it have been made, and how many per cent of the work that an encoding may take it needs.
    """
    names, rows = (*learned[0], *STEPS, *learned[1]), []
    for number, name in enumerate(names):
        row: dict[str, Any] = {"choice": name}
        for half, chosen in halves.items():
            saved, share = _means(store, [case.name for case in chosen], rel_error, names[:number], name)
            row |= {f"{half}: saves %": 100 * (1 - math.exp(-saved)), f"{half}: work %": 100 * share}
        rows.append(row)
    return rows


def _file_rows(
    store: Store, chosen: Sequence[Case], rel_error: float, of_encoder: Order, learned: Order
) -> list[dict[str, Any]]:
    """Return a row for each clip that compares its bytes with the encoder's order of choices, with the learned order,
    and at effort "best".
    """

    def file(case: Case, one: Order, effort: str = "default") -> dict[str, Any]:
        key = {"clip": case.name, "bound": rel_error, "order": _text(one), "effort": effort}
        return store.find("files", key) or {}

    rows = []
    for case in chosen:
        of_order, other, best = file(case, of_encoder), file(case, learned), file(case, of_encoder, "best")
        rows.append(
            {
                "clip": case.name,
                "encoder": of_order["bytes"],
                "learned": other["bytes"],
                "best": best["bytes"],
                "learned / encoder": other["bytes"] / of_order["bytes"],
                "default / best": of_order["bytes"] / best["bytes"],
                "seconds": of_order["seconds"],
                "seconds, best": best["seconds"],
                "untried": ", ".join(of_order["untried"]),
            }
        )
    return rows


def _summary(rows: Sequence[Mapping[str, Any]]) -> dict[str, Any]:
    """Return a summary of the files of one half: the mean bytes with the learned order over those with the encoder's
    order, how many files at default effort are much larger than at effort "best", and the sum of the seconds.
    """
    return {
        "clips": len(rows),
        "files that differ": sum(row["learned / encoder"] != 1 for row in rows),
        "learned / encoder": mean(row["learned / encoder"] for row in rows),
        f"default / best above {USUAL:g}": sum(row["default / best"] > USUAL for row in rows),
        f"above {MOST:g}": sum(row["default / best"] > MOST for row in rows),
        "most": max(row["default / best"] for row in rows),
        "seconds": sum(row["seconds"] for row in rows),
    }
