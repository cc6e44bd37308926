"""What a sweep leaves behind: the columns of its table, files that are whole or absent, and how controllers are shown.

Neither statistics nor data frames are needed here, for every worker imports it.
"""
