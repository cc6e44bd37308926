"""Words a summary once, as sections of tables, and lays them out for the terminal and in Markdown.

The page of `sim.report` loops over the same tables, so that no number is told in two ways.
"""
