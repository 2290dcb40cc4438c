"""What codes share that step by velocity Verlet in absolute coordinates: steps, readings, error."""
