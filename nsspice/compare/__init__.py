"""Comparison with expected numbers and reference waveforms."""
