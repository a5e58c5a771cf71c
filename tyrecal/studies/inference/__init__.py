"""Observations beside the model of a tyre, their covariance, and the model between designs."""
