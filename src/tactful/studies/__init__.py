"""The experiments behind the figures in the documentation, from trials to tables and pictures."""
