"""What a caller asks for beside the bound: options of a file, precision of the rest pose, weights, features."""
