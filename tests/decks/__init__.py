"""Decks that several tests share: single ones, families by a seed, and helpers that build them."""
