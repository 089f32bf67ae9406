"""Files as bytes: opening, replacing and fetching them."""
