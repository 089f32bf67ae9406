"""The order in which a search makes its choices.

`python -m bench effort` learns an order on clips of one half of their makers, by what choices save for their work, and
judges it on those of the other half (bench/results/effort.json). The order learned makes files of the learning half
hardly smaller, and one of the other half a quarter larger, so this one, made by hand, stays. The names are those of the
functions that search.py makes choices by.
"""

BEFORE_STEPS = (  # Learned modes are of pieces, which forms decide on, so they are chosen after these.
    "still_if_smaller",
    "best_forms",
    "best_rotations",
    "best_bases",
    "best_forms_again",
)
# Small clips alone are settled, for much work, so rotations that pay with learned modes come before. In layers they
# alone have finer steps, too: trials code the last layer, and fields of plants grew by 2 % with these.
AFTER_STEPS = ("best_rotations", "settled", "calm_parts", "best_slack", "waves_if_smaller", "best_bases", "finer_steps")
