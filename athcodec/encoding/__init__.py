"""The encoder: from a motion clip to the bytes of an .ath file.

Data flows one way. A clip is sampled (sample.py, segment_samples.py). Its settings are searched (search.py): each
choice (choices/) is made by trials (trials.py). A segment's motion is analysed (motion.py, learned_modes.py), quantised
(quantise.py) and coded in layers (layers.py, segment.py, streams.py); job.py puts the file together (writing.py).
encoder.py has the entry points. Decoding imports nothing from here.
"""

from athcodec.encoding.decided import CodedSegment, Draft
from athcodec.encoding.encoder import code_segments, draft, encode_clip, write
from athcodec.encoding.summary import Seam, Summary

__all__ = ["CodedSegment", "Draft", "Seam", "Summary", "code_segments", "draft", "encode_clip", "write"]
