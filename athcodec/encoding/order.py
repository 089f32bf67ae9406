"""The order in which a search makes its choices: what saves most bytes for its work comes first.

`python -m bench effort` learns it on clips of one half of their makers, judges it on those of the other half, and
prints both (bench/results/effort.json). The names are those of the functions that search.py makes choices by.
"""

BEFORE_STEPS = (  # Learned modes are of pieces, which forms decide on, so they are chosen after these.
    "best_bases",
    "still_if_smaller",
    "best_forms_again",
    "best_rotations",
    "best_freedom",
    "best_forms",
)
AFTER_STEPS = (  # Small clips alone are settled.
    "settled",
    "calm_parts",
    "best_slack",
    "waves_if_smaller",
    "best_rotations",
    "best_bases",
)
