"""The viewer: pages and pictures of .ath files."""
