"""Passes: functions from Gaussians to Gaussians, in folders by what they change; `where` selects."""
