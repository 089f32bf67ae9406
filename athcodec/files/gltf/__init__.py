"""glTF as a container: JSON, buffers, accessors, and the .ath files in it (ATH_motion)."""
