"""All baselines."""

from __future__ import annotations

from bench.codecs import Codec
from bench.codecs.acl import SkeletalTracks
from bench.codecs.coddyac import Coddyac
from bench.codecs.lengyel import Lengyel
from bench.codecs.pca import ClusteredPca, GlobalPca

KINDS = (GlobalPca, ClusteredPca, Lengyel, Coddyac, SkeletalTracks)
BASELINES: list[Codec] = [kind() for kind in KINDS]
