"""A clip is made ready: its bound, its places, its branches, its record, its survey."""
