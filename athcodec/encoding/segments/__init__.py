"""How a clip is coded under given settings: segments, time bases, layers, joins, stages."""
