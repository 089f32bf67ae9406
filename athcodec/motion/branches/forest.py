"""The cheapest forest of a directed graph: every node hangs on another one or is a root, at the least total cost.

Chu and Liu 1965, Edmonds 1967: every node takes its cheapest edge; cycles that this closes become single nodes, whose
edges cost what they cost more than those of the cycle that they replace; and so on until there are no cycles.
"""

from __future__ import annotations

import numpy as np

from athcodec.motion.branches.groups import cheapest_of_each
from athcodec.motion.hierarchy import branch_orders


def cheapest_forest(count: int, child: np.ndarray, parent: np.ndarray, cost: np.ndarray) -> np.ndarray:
    """Return the cheapest forest that arcs from children to parents can form: for each of `count` nodes the number of
    the arc that leads to its parent, (count,).

    `child`, `parent`, `cost`: (E,) arrays, one row for each arc: two nodes, and what it costs to take it. An arc whose
    parent is the number `count` makes its child a root; every node needs one such arc.
    """
    rounds: list[tuple[np.ndarray, np.ndarray, np.ndarray]] = []
    while True:
        best = cheapest_of_each(child, cost)
        is_in_cycle, name = _cycles(np.append(parent[best], count))
        if not is_in_cycle.any():
            break
        cost = cost - np.where(is_in_cycle[child], cost[best][child], 0.0)
        _, number = np.unique(name, return_inverse=True)  # The hub's, the largest, stays the largest.
        kept = np.flatnonzero(number[child] != number[parent])
        rounds.append((best, child, kept))
        child, parent, cost, count = number[child][kept], number[parent][kept], cost[kept], int(number[-1])
    for before, of_node, kept in reversed(rounds):
        entering = kept[best]
        best = before.copy()
        best[of_node[entering]] = entering
    return best


def _cycles(above: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return two things: which nodes lie in cycles, (count + 1,) bool; and a name for each node, (count + 1,), which
    the nodes of one cycle share. `above`: the parent of each node, where the last node is the parent of itself and of
    all roots.
    """
    every, step = np.arange(len(above)), above
    least = every
    for _ in range(len(above).bit_length()):
        least = np.minimum(least, least[step])
        step = step[step]
    is_in_cycle = np.zeros(len(above), bool)
    is_in_cycle[step] = True  # What many steps lead to: cycles, all of which they reach, and the hub.
    is_in_cycle[-1] = False
    return is_in_cycle, np.where(is_in_cycle, least, every)


def without_needless_orders(
    child: np.ndarray, parent: np.ndarray, cost: np.ndarray, chosen: np.ndarray, price: float, each: float
) -> np.ndarray:
    """Return the arcs chosen for the branches, (B,), after branches of the highest order were moved to parents of lower
    order, as often as that costs little: at most `each` for a branch in the mean, and at most `price`, that of a level,
    for all of the order. The arcs `child`, `parent`, `cost` are those of `cheapest_forest`; `chosen`: (B,) what it
    returned.
    """
    chosen, count = chosen.copy(), len(chosen)
    while True:
        order = np.append(branch_orders(np.where(parent[chosen] == count, -1, parent[chosen])), -1)
        highest = order.max()
        lower = np.flatnonzero((order[child] == highest) & (order[parent] < highest - 1))
        if highest < 1:
            return chosen
        best = lower[cheapest_of_each(child[lower], cost[lower])]
        if (cost[best] - cost[chosen[child[best]]]).sum() > min(price, each * len(best)):
            return chosen
        chosen[child[best]] = best
