"""Figures of simulated missions, from the run files that ``pdn sim --out`` leaves."""
