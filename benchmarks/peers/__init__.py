"""Other programs on the same impact: settings, and time to an error.

See docs/peers.md.
"""
