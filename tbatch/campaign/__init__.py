"""Many runs kept: sampling, shards, the result store and its statistics."""
