"""Before the march: a scene as a network of nodes, rod pieces and contacts."""
