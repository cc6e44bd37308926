"""What is concluded from a sweep: thresholds, rates, the score of the prediction, and comparisons with a baseline.

All of it works on one data frame, a row an episode (`frame`), and ends in one summary of JSON types (`summary`).
"""
