"""Other programs on the same impact: how each was set, what it takes to reach an error. See docs/peers.md."""
