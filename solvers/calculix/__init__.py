"""Runs CalculiX (ccx 2.20) on decks of one cyclic sector, and believes it only with proof."""
