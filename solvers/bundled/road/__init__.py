"""The tyre pressed on the road: contact, footprints, and modes there."""
