"""The format's own material: the reference decoder, the vectors and the programs that hold decoders to them."""
