"""The hand descriptions: one folder each, holding `hand.yaml`."""
