"""Passes: functions from Gaussians to Gaussians, such as pruning, clustering and recolouring."""
