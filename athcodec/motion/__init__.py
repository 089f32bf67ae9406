"""A clip of a plant in motion: frames, branches, polygons, units."""
