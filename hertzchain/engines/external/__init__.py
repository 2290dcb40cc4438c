"""Common part of engines that step by velocity Verlet in absolute coordinates."""
