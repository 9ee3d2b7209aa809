"""Passes: functions from Gaussians to Gaussians, by what they change; `where` selects."""
