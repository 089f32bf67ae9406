"""Comparison of rate-distortion points: mean savings and size ratios of athcodec against others, beside targets.

The points come from rd.py. The ratio at a bound is that of the smallest files that each codec makes within this bound.
For ratios at equal RMS, the points of a codec, which were tuned for the bound, form a curve on which the size is
interpolated (curves.py). On odd clips the target is another: to be no larger than a simple codec anywhere.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable
from math import exp, log
from typing import Any

from bench.codec_registry import OURS
from bench.codecs import simple
from bench.curves import Curve, mean_saving

Point = dict[str, Any]

BOUND_TARGETS = {"program": {1e-3: 6.5, 1e-4: 5.0, 1e-5: 2.8}, "baseline": {1e-3: 2.0, 1e-4: 1.6, 1e-5: 1.3}}
KG_TARGETS = {0.1: 2.5, 0.01: 1.9}  # against PCA; Karni-Gotsman error in per cent
PCA_NAMES = ("pca", "coddyac")
SIMPLE_SHARE, SIMPLE_BYTES = (
    1.02,
    160,
)  # Our files may take this share of the simple codec's size, and so many bytes more.


def measured(points: Iterable[Point]) -> list[Point]:
    """Points with a file whose error is within their bound."""
    return [point for point in points if point["status"] == "ok"]


def curve(points: Iterable[Point], codec: str, error: str) -> Curve:
    """Bytes over `error` ("max", "rms" or "kg") of one codec's points of one clip."""
    own = [point for point in measured(points) if point["codec"] == codec]
    return Curve.of([point[error] for point in own], [point["bytes"] for point in own])


def _names(points: Iterable[Point], keep) -> list[str]:
    return list(dict.fromkeys(point["codec"] for point in points if keep(point)))


def is_pca(point: Point) -> bool:
    return any(name in point["codec"].lower() for name in PCA_NAMES)


def our_names(points: Iterable[Point]) -> list[str]:
    return _names(points, lambda point: point["kind"] == OURS)


def savings(points: list[Point], ours: str) -> list[dict[str, Any]]:
    """A row for every other codec on one clip: mean saving over the errors that both curves cover."""
    rows = []
    for codec in _names(points, lambda point: point["codec"] != ours and point["bound"] > 0):
        row: dict[str, Any] = {"against": codec}
        for error, name in (("max", "max error"), ("rms", "RMS")):
            saving = mean_saving(curve(points, ours, error), curve(points, codec, error))
            row |= {
                f"{name}: saved %": saving and saving.percent,
                f"{name} from": saving and saving.low,
                f"{name} to": saving and saving.high,
            }
        rows.append(row)
    return rows


def ratios(points: list[Point], ours: str) -> list[dict[str, Any]]:
    """Rows for one clip: the smallest size of each kind of codec over ours, at the same error, beside the target."""
    rows = []
    for kind, targets in BOUND_TARGETS.items():
        for bound, target in targets.items():
            at = [point for point in measured(points) if point["bound"] == bound]
            size = next((point["bytes"] for point in at if point["codec"] == ours), None)
            others = {point["codec"]: point["bytes"] for point in at if point["kind"] == kind}
            rows.append(_ratio_row(kind, f"max {bound:g}", size, others, target))
    pca = _names(points, is_pca)
    for kg, target in KG_TARGETS.items():
        sizes = {codec: curve(points, codec, "kg").size_at(kg) for codec in pca}
        others = {codec: size for codec, size in sizes.items() if size is not None}
        rows.append(_ratio_row("PCA", f"KG {kg:g} %", curve(points, ours, "kg").size_at(kg), others, target))
    return rows


def _ratio_row(against: str, error: str, size: float | None, others: dict[str, float], target: float) -> dict[str, Any]:
    best = min(others, key=others.get, default=None)
    ratio = others[best] / size if best is not None and size is not None else None
    return {
        "against": against,
        "at": error,
        "bytes": size and round(size),
        "best of them": best,
        "its bytes": best and round(others[best]),
        "ratio": ratio,
        "target": target,
        "met": None if ratio is None else ratio >= target,
    }


def over_clips(rows: Iterable[dict[str, Any]]) -> list[dict[str, Any]]:
    """Ratios over all clips: the least and the geometric mean for each kind and error."""
    groups: dict[tuple, list[dict[str, Any]]] = {}
    for row in rows:
        groups.setdefault((row["codec"], row["against"], row["at"], row["target"]), []).append(row)
    result = []
    for (codec, against, error, target), members in groups.items():
        found = {row["clip"]: row["ratio"] for row in members if row["ratio"] is not None}
        least = min(found, key=found.get, default=None)
        mean = exp(sum(map(log, found.values())) / len(found)) if found else None
        result.append(
            {
                "codec": codec,
                "against": against,
                "at": error,
                "clips": len(found),
                "geometric mean": mean,
                "least": least and found[least],
                "least on": least,
                "target": target,
                "mean meets it": None if mean is None else mean >= target,
                "all meet it": None if least is None else found[least] >= target,
            }
        )
    return result


# ---- odd clips ----


def against_simple(points: Iterable[Point], ours: str) -> list[dict[str, Any]]:
    """A row for each clip and bound at which `ours` has a file: its bytes, those of the simple codec and of the best of
    all others, and whether ours is within what the simple codec allows; None where that has no file.
    """
    sizes: dict[tuple[str, float], dict[str, int]] = {}
    for point in measured(points):
        sizes.setdefault((point["clip"], point["bound"]), {})[point["codec"]] = point["bytes"]
    return [_simple_row(clip, bound, codecs, ours) for (clip, bound), codecs in sizes.items() if ours in codecs]


def _simple_row(clip: str, bound: float, codecs: dict[str, int], ours: str) -> dict[str, Any]:
    size, plain = codecs[ours], codecs.get(simple.NAME)
    others = {codec: bytes_ for codec, bytes_ in codecs.items() if codec != ours}
    best = min(others, key=others.get, default=None)
    return {
        "clip": clip,
        "bound": f"{bound:g}",
        "ours": size,
        "simple": plain,
        "ours/simple": None if plain is None else size / plain,
        "within": None if plain is None else size <= plain * SIMPLE_SHARE + SIMPLE_BYTES,
        "best other": None if best is None else others[best],
        "its name": best,
    }


def beaten(rows: Iterable[dict[str, Any]], plants: Collection[str]) -> list[dict[str, Any]]:
    """How many rows of against_simple fail in either way, and how many of them show plants."""
    rows = list(rows)
    kinds = {
        "all": rows,
        "ours larger than simple allows": [row for row in rows if row["within"] is False],
        "another codec smaller": [
            row for row in rows if row["best other"] is not None and row["best other"] < row["ours"]
        ],
    }
    return [
        {"rows": name, "of all": len(some), "of plants": sum(row["clip"] in plants for row in some)}
        for name, some in kinds.items()
    ]
