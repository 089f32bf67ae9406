"""Numbers just above and below those that rules compare with."""

from spec.make.base import *
from spec.make.predicted import predicted, swayed


def mode_and_more(share: float) -> list[list[float]]:
    """Return two places along x as the first mode of a sheet of two vertices, but for a share of it."""
    mode = rules.cantilever((4, 4), 0.1, 0.001, 1.0)[0]
    across = np.array([-mode[1], mode[0]])
    return [[x, 0.0, 0.0] for x in mode + share * across]


def in_binary64(name: str) -> Plant:
    made = MADE[name]
    plant = made() if callable(made) else made
    assert isinstance(plant, Plant)
    return replace(plant, is_float64=True)


for side_, size_ in (("above", 1.015), ("below", 0.985)):
    valid(
        f"sheet-thin-{side_}: a sheet that is {side_} 1/100 as wide as long, once turned",
        placed,
        [Stem(-1, 1), Stem(0, 4, 0, SHEET)],
        [[0, 0, 0], *([x, x + y * 0.01 * size_, 0] for x, y in ((1, 1), (1, -1), (-1, 1), (-1, -1)))],
        135,
    )
    valid(
        f"sheet-mode-{side_}: a sheet whose places leave {side_} 1/100000 of a mode",
        lambda size_=size_: placed([Stem(-1, 1), Stem(0, 2, 0, SHEET)], [[0, 0, 0], *mode_and_more(1e-5 * size_)], 136),
    )
    valid(
        f"tube-function-{side_}: a tube whose rings leave {side_} 1/100000 of a function",
        placed,
        [Stem(-1, 6, flags=SHEET, ring=2)],
        [[10.0 * i + y, s * (1 + 2e-5 * size_ * (i == 2) + 0 * y), s] for i in range(3) for s, y in ((-1, 0), (1, 0))],
        137,
    )
    valid(
        f"tangent-short-{side_}: a stem of {side_} 1e-100, which has a direction or none",
        lambda size_=size_: placed(
            [Stem(-1, 2), Stem(0, 2, 1)], [[0, 0, 0], [0, 1e-100 * size_, 0], [0, 1, 1], [0, 2, 1]], 138
        ),
    )
    valid(
        f"sheet-short-{side_}: a sheet whose matrix to turn by has squares that add up to {side_} 1e-200",
        placed,
        [Stem(-1, 2), Stem(0, 2, 0, SHEET), Stem(1, 2, 1)],
        [[0, 0, 0], [0, 1, 0], [0, 1e-50 * (size_**2 / 1.0203) ** 0.25, 0], [0, 0, 0], [0, 1, 1], [0, 2, 1]],
        139,
        is_float64=True,
        scripts={(STEMS, 1): [*row(), *row((9, -5, 7), (3, 8, -6))]},
        heads={1: stems_head(0.125, 1)},
    )
    valid(
        f"predicted-short-{side_}: a step and a way at rest whose squares add up to {side_} 1e-60",
        predicted,
        [Stem(-1, 3, flags=WHOLE)],
        swayed(6, 140, [Stem(-1, 3, flags=WHOLE)], follow=1.0, still=0.1),
        rest=exact_rest([Stem(-1, 3)], [x * 1e-30 * size_ for x in (0, 0, 0, 0, 0.3, 0.2, 0, 1, 0)], True),
        predicted=predicted_head(1e-33),
        is_float64=True,
    )
for name_ in (
    "sheet-mode-above",
    "sheet-thin-below",
    "shapes-high",
    "shapes-of-sheets",
    "tube-function-below",
    "layers-periodic",
    "source-rest-far",
    "source-rest-detail",
    "predicted-references",
    "predicted-about-copies",
):
    valid(
        f"{name_}-in-binary64: the same in binary64, which shows the order of every sum and product", in_binary64, name_
    )
