"""Published parameter sets, each with its source."""
