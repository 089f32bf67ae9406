"""A format of another package: what athcodec has to know before it reads or writes a file of it."""

from athcodec.sources import Format

MAGIC = b"points 1\n"
SOURCE = Format("points", "points in lines of text", (".points",), magic=(MAGIC,), module="athcodec_points.text")
EXPORTER = SOURCE
