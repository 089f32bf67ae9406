"""Reading of .ath files, which knows nothing of encoding."""
