"""The posterior of the design variables, drawn on an emulator."""
