"""Mechanisms: planar chains of rigid and flexible links.

They are bodies with a mass matrix of their own at each state.
"""
