"""All baselines, each with athcodec's entropy coder and with zstd -19."""

from __future__ import annotations

from bench.codecs import Codec
from bench.codecs.acl import SkeletalTracks
from bench.codecs.coddyac import Coddyac
from bench.codecs.coder import RangeCoder, Zstd
from bench.codecs.lengyel import Lengyel
from bench.codecs.lorenzo import Lorenzo
from bench.codecs.paper_ath import PaperAth
from bench.codecs.pca import ClusteredPca, GlobalPca, PredictedPca

KINDS = (GlobalPca, Lengyel, PredictedPca, ClusteredPca, Coddyac, SkeletalTracks, Lorenzo, PaperAth)
BASELINES: list[Codec] = [kind(coder) for kind in KINDS for coder in (RangeCoder(), Zstd())]
