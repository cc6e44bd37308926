"""Many episodes: planned from a suite, run side by side, each written down as it ends, resumed and replayed."""
