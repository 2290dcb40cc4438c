"""Results of other codes as people have them: tables, logs and dumps."""
