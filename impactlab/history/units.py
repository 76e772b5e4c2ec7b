"""Units and long names of channels and fields."""

from __future__ import annotations

UNITS = {
    "displacement": "m",
    "velocity": "m/s",
    "strain": "1",
    "stress": "Pa",
    "force": "N",
    "rotation": "rad",
    "bending_moment": "N m",
    "shear_force": "N",
    "twist": "rad",
    "twist_rate": "rad/s",
    "torque": "N m",
    "position": "m",
    "momentum": "N s",
    "energy": "J",
    "angle": "rad",
    "rate": "rad/s",
    "shortening": "m",
    "drive": "N m",
    "gap": "m",
    "contact_force": "N",
}

LONG_NAMES = {name: name.replace("_", " ") for name in UNITS} | {
    "strain": "strain, positive in compression",
    "stress": "stress, positive in compression",
    "force": "force inside the body, positive in compression",
    "contact_force": "contact force, positive in compression",
    "gap": "gap, positive when open",
    "position": "displacement of a mass, or position of a face of a mechanism",
    "angle": "angle of a link or of a mechanism, from +x",
    "rate": "angular rate of a link or of a mechanism",
    "shortening": "length of a bent link less that of its projection on its frame",
    "drive": "moment of the drive of a link",
}
