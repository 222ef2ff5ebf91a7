"""What this machine steps: the batch engine beside one run at a time in SciPy, measured in one go."""
