"""The motion model as an encoder runs it: plans of plants, motion of segments, learned modes, quantisation steps."""
