"""What a controller at joint level is given and answers while nobody pushes it: the numbers of `okiagari policy`."""
