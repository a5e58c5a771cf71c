"""The ABAQUS keyword language: one reader and one table for the tool and for every solver."""
