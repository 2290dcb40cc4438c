"""What simulations by other codes share that step by velocity Verlet in absolute coordinates.

Which step, how often it is looked at, what came of it and how wrong that is: the same whoever takes
the steps. How a code is told of a scene, and run, is its backend's own.
"""
