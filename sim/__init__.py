"""The world: physics, episodes, pictures, command line."""
