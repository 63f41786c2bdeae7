"""One file per family of cards: what the items of an element line or a dot line mean."""
