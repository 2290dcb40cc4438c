"""Measured pulses: from the file of an oscilloscope to a pulse table of a scene."""
