"""Mechanisms: planar chains of rigid and flexible links, with a mass matrix of their own at each state."""
