"""Sweeps: peaks and p of many scenes with different pulses, materials and chains."""
