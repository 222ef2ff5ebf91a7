"""Finite element matrices of a track, read from the files of the codes that made them."""
