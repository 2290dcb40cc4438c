"""What is seen of a run, whoever simulated it: peaks, work, histories, error, result."""
