"""The encoder: from a motion clip to the bytes of an .ath file.

encoder.py has the entry points. It calls four parts one after the other:

1. preparation/ makes a clip ready. It finds places and branches, makes the one record of the clip as it is coded
   (clip/coded_clip.py), and has its frames surveyed (clip/survey.py).
2. decisions.py decides about the file. Settings are searched (search/) on a sample of the plant and of its segments.
   Each choice (search/choices/) is made by trials (search/trials.py).
3. assembly/segment_coding.py codes the segments. Their motion is analysed and quantised (model/), and coded in layers
   (segments/) as streams (streams/).
4. assembly/assembly.py puts the file together.

options/ holds what a caller asks for. Each folder imports only those that stand below it in the picture of
CONTRIBUTING.md. Decoding imports nothing from here.
"""

from athcodec.encoding.assembly.decided import CodedSegment, Draft
from athcodec.encoding.assembly.summary import Seam, Summary
from athcodec.encoding.encoder import code_segments, draft, encode_clip, write

__all__ = ["CodedSegment", "Draft", "Seam", "Summary", "code_segments", "draft", "encode_clip", "write"]
