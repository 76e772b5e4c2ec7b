"""Set-up of the exact solver: a scene as a network of nodes, rod pieces and contacts."""
