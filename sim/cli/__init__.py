"""The command line: one file a group of commands; whatever takes long to import is imported by the command."""
