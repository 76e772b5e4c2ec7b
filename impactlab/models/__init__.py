"""Models: bodies in space, as meshes, modes, continuous or rigid."""
