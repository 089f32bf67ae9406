"""A clip as it is coded: its places, its record, and the survey of its frames."""
