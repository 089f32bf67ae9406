"""The choices that an encoder makes about a file, one module for each.

A module offers functions of settings and trials that return the settings with the alternative that makes the smallest
file. Most compare a few candidates, so that they cost as many trials; those that no longer fit the work that is allowed
cost infinitely much. A choice that takes other work counts it. search.py says in which order choices are made.
"""
