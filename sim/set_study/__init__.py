"""Sets without episodes: the numbers of `okiagari sets`, and the paper's figures of `okiagari figures`."""
