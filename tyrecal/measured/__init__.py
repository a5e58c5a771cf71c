"""Measured data: modal tables, mode shapes and frequency-response functions, as measurements."""
