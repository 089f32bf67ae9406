"""The encoder: from a motion clip to the bytes of an .ath file.

Data flows one way, through four stages that encoder.py, which has the entry points, calls one after the other:

1. preparation.py makes a clip ready. Places (places.py) and branches (branch_trials.py) are found. One frozen record
   (coded_clip.py) then holds the clip as it is coded, and its frames are surveyed (survey.py).
2. decisions.py decides about the file. Settings are searched (search.py) on a sample (sample.py, segment_samples.py):
   each choice (choices/) is made by trials (trials.py). decided.py has the records of what is decided.
3. segment_coding.py codes segments. Motion is analysed (motion.py, learned_modes.py), quantised (quantise.py) and coded
   in layers (layers.py, segment.py, streams.py).
4. assembly.py puts the file together (writing.py).

Decoding imports nothing from here.
"""

from athcodec.encoding.decided import CodedSegment, Draft
from athcodec.encoding.encoder import code_segments, draft, encode_clip, write
from athcodec.encoding.summary import Seam, Summary

__all__ = ["CodedSegment", "Draft", "Seam", "Summary", "code_segments", "draft", "encode_clip", "write"]
