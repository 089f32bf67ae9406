"""From integers to bytes: streams, and the chunks that hold them."""
