"""What only an encoder needs: from a motion clip to the bytes of an .ath file.

Data flows one way: a clip is sampled (sample.py) and its settings are searched (search.py); a segment's motion is
analysed (motion.py, learned_modes.py), quantised (quantise.py) and coded (segment.py, streams.py); encoder.py puts the
file together. Decoding imports nothing from here.
"""

from athcodec.encoding.encoder import (
    DEFAULT_REL_ERROR,
    EFFORTS,
    CodedSegment,
    Draft,
    Seam,
    Summary,
    code_segments,
    draft,
    encode,
    write,
)

__all__ = ["DEFAULT_REL_ERROR", "EFFORTS", "CodedSegment", "Draft", "Seam", "Summary", "code_segments", "draft", "encode",
           "write"]
