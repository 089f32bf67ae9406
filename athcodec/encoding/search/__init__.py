"""The search for settings: samples, trials, and the choices that are made by them."""
