"""What happens: scenario files and their schema."""
