"""Where the gap between a calibrated model and measurements lies, and which effect explains it."""
