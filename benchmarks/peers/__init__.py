"""Other programs on the same impact: settings of each, and time to reach an error. See docs/peers.md."""
