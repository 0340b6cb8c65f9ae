"""The descriptions of hands and arms: one folder each, holding `hand.yaml` or `arm.yaml`."""
