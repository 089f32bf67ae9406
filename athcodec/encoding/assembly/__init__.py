"""A file is made from what is decided: its segments are coded and put together."""
