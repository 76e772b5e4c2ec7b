"""Meshes of rods and beams: elements, masses of nodes, absorbing layers, massless faces."""
