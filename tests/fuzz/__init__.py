"""Fuzzing of the decoder: C targets for libFuzzer under sanitizers, their seeds, and random clips there and back.

`python -m tests.fuzz` runs them. Importable as `fuzz` where tests/ is on the path, as it is for the tests.
"""
