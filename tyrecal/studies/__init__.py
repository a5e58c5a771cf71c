"""Studies: what is asked of a tyre model beside its fit."""
