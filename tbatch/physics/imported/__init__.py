"""Tracks from the matrices of finite element software: checked, stripped of what the rail never moves, ordered."""
