"""Measurements of athcodec's file sizes and speed: `python -m bench VERB` in the repository's root.

Needs athcodec installed; other codecs and the physics engine are used where they are installed (the extra
`bench`). One module per verb, each with `add_arguments(parser)` and `run(args) -> dict`; tables.py describes the
dictionary. The package athcodec never imports this one.
"""
