"""The format: FORMAT.md's code as a decoder, the test vectors, and the program that tests decoders against them."""
