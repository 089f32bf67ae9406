"""The format's own: the reference decoder, the vectors, and the program that holds decoders to them."""
