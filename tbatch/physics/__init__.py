"""What the models are: vehicles, tracks, contact, irregularities. Plain NumPy, readable against the equations."""
