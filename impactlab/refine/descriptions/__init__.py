"""Descriptions of a scene that one number refines, and those that suit a scene."""
