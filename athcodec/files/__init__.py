"""Files as bytes: opening, replacing, fetching; it knows nothing of plants."""
