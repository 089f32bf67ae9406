"""Branches of clips that name none: finding them, and files that keep them."""
