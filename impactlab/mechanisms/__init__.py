"""Mechanisms: planar chains of rigid and flexible links, as bodies with a mass matrix of their own at each state."""
