"""Results of other codes as people have them: tables, logs, dumps and trajectories."""
