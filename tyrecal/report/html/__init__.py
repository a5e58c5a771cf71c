"""The results of one or several folders as one HTML page."""
