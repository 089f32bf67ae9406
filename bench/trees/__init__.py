"""Plants in wind to measure with: grown, moved as beams, dressed with bark and leaves.

One module per step, each given a seed and nothing from outside: plant (the branching), wind (the turbulence),
beams (the motion of the nodes), ride (what is carried by them), leaves (hinged blades), mesh (faces).
Nothing here knows of caches, files or the command line; see bench/data.py.
"""
