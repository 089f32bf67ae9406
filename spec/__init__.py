"""The format: the reference decoder, the test vectors, and the program that tests decoders against them."""
