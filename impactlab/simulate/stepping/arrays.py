"""The memory of a run: records with names and a few flat arrays, all made before the first step.

A record is a C structure, read and written under the same names by the compiled loop and by plain Python.
"""

from __future__ import annotations

import ctypes
from typing import Any, NamedTuple

from numpy import float64, int64
from numpy.typing import NDArray

Floats = NDArray[float64]
Ints = NDArray[int64]

INTEGER, REAL = ctypes.c_int64, ctypes.c_double


class BodyRecord(ctypes.Structure):
    """One body: its stepper's addresses and where its pieces lie in the flat arrays."""

    _fields_ = [
        *((name, INTEGER) for name in ("free", "measure", "retime", "derive")),  # addresses
        *((name, INTEGER) for name in ("parameter_start", "parameter_end", "state_start", "state_end", "n_dof")),
        *((name, INTEGER) for name in ("n_ports", "jump_start", "force_start", "impulse_start", "projection_start")),
    ]


class FaceRecord(ctypes.Structure):
    """One side of a contact: two to a contact, left then right."""

    _fields_ = [
        ("body", INTEGER),
        ("place", INTEGER),  # which of its body's faces
        ("low", INTEGER * 9),  # what a force, an impulse, a projection moves at all of the body's displacements,
        ("high", INTEGER * 9),  # velocities and the rest (the last index): ranges of its state
        ("sign", REAL),  # direction of the push: -1 left, +1 right
        ("u", REAL),  # m, at the start of the step
        ("v", REAL),  # m/s
        ("free_u", REAL),  # m, at the end without contact
        ("free_v", REAL),  # m/s
    ]


class ContactRecord(ctypes.Structure):
    """One contact: its law and what the loop keeps of it."""

    _fields_ = [
        ("law", INTEGER),  # address
        ("dates", INTEGER),  # 1 where closings and openings are dated: the law answers by force
        ("smooth", INTEGER),  # 1 where the force follows from gap and rate alone
        ("trial_point", REAL),  # where in the step the trial force belongs
        ("initial_gap", REAL),  # m
        ("force", REAL),  # N, of the last step
        ("impulse", REAL),  # N s
        ("projection", REAL),  # kg m
        ("push", REAL),
        ("left_share", REAL),  # of the offset: how much of it is the left face's
        ("old_gap", REAL),  # m, one step before
        ("old_trial", REAL),  # N
        ("touching", REAL),  # 1 where a located touch begins this step
        ("span_impulse", REAL),  # N s, of the contact under way
        ("span_peak", REAL),  # N
        ("last_event", REAL),  # s
        ("sum_force", REAL),  # N s, since the last record
        ("total", REAL),  # N s, force times time and impulses, since t = 0
        ("negative", REAL),  # J, sum of the losses below zero that the law replied; zero of a law that keeps its word
    ]


class MessengerRecord(ctypes.Structure):
    """A reading that a law wants: of which body, for which contact, and into which slot of its port."""

    _fields_ = [("body", INTEGER), ("contact", INTEGER), ("slot", INTEGER)]


class PushRecord(ctypes.Structure):
    """A row along which a contact may push a body, beside the force along its gap."""

    _fields_ = [
        *((name, INTEGER) for name in ("contact", "body", "place")),
        ("low", INTEGER * 3),  # as of a face: what the push moves at all
        ("high", INTEGER * 3),
        ("weight", REAL),
    ]


class PhaseRecord(ctypes.Structure):
    """A body that takes other coordinates while a contact is closed; see `Memory.other_state`."""

    _fields_ = [("contact", INTEGER), ("body", INTEGER), ("closed", INTEGER), ("map_start", INTEGER)]


class DamperRecord(ctypes.Structure):
    """A dashpot between two coordinates, or to the ground: the entries of the state it moves with."""

    _fields_ = [
        ("index", INTEGER),
        ("other", INTEGER),  # -1 for the ground
        ("inside", INTEGER),  # 1 where it stands for damping inside the body, not for a dashpot at its end
        ("damping", REAL),
        ("old", REAL),  # m, at the start of the step
        ("straddles", REAL),  # 1 where the dashpot feels the mean velocity of this step and the one before (leapfrog)
        ("before", REAL),  # m, moved in the step before
    ]


class EventRecord(ctypes.Structure):
    """One event, with what the contact that it ends had gathered."""

    _fields_ = [
        ("time", REAL),
        ("contact", INTEGER),
        ("kind", INTEGER),
        ("impulse", REAL),
        ("span_impulse", REAL),
        ("span_peak", REAL),
    ]


class SnapshotRecord(ctypes.Structure):
    """A snapshot: the time asked for and the two instants around it."""

    _fields_ = [("time", REAL), ("before", REAL), ("after", REAL)]


class ClockRecord(ctypes.Structure):
    """Where the run is: all that goes on from one call of the loop to the next."""

    _fields_ = [
        ("time", REAL),
        ("step", INTEGER),
        ("steps", INTEGER),  # of the whole run
        ("n_records", INTEGER),
        ("n_samples", INTEGER),
        ("n_events", INTEGER),
        ("n_snapshots", INTEGER),
        ("lost_contact", REAL),  # J booked so far
        ("lost_ends", REAL),  # J
        ("lost_inside", REAL),  # J, by damping inside bodies
        ("lost_unresolved", REAL),  # J, handed to modes that are left out
        ("timed", REAL),  # s, the step length that the steppers are prepared for
        ("recorded", REAL),  # s, time of the last record
        ("energy", REAL),  # scratch of `measure`
    ]


class Memory(NamedTuple):
    """All that the loop touches.

    Rows of `index` and `value`: face displacements, face velocities, readings, probes, pushes.
    """

    clock: Any  # (1,) of ClockRecord
    bodies: Any  # (n_bodies,) of BodyRecord
    faces: Any  # (2 n_contacts,) of FaceRecord
    contacts: Any  # (n_contacts,) of ContactRecord
    ports: Any  # (n_contacts,) of Port
    replies: Any  # (n_contacts,) of Reply
    messengers: Any  # (n_readings,) of MessengerRecord
    pushes: Any  # (n_pushes,) of PushRecord
    phases: Any  # (n_phases,) of PhaseRecord
    dampers: Any  # (n_dampers,) of DamperRecord
    events: Any  # (room,) of EventRecord
    snapshots: Any  # (n_snapshots,) of SnapshotRecord
    parameters: Floats  # flat, of all steppers
    state: Floats  # flat
    backup: Floats  # room for a step to be taken again
    momentum: Floats  # row over the state, N s
    jump: Floats  # flat: velocities per impulse of each face
    responses: Floats  # flat: force responses of each body's ports, then impulse and projection responses
    answers: Floats  # (9, 3 n_contacts, n_contacts) of faces (2 n_contacts) and pushed rows to contacts: see the layers
    row_start: Ints  # (n_rows + 1,)
    row_index: Ints  # into the state
    row_value: Floats
    left_out: Floats  # (n_readings, n_contacts) answer of the modes left out per force of the step before
    record: Floats  # (room, 1 + 6 n_contacts + n_probes) time; force, gap; left u, v, right u, v; probes
    sample: Floats  # (room, 6 + 3 n_bodies) time, stored, four losses; energy, work, momentum of each body
    snapshot_state: Floats  # (n_snapshots, 2, n_state)
    scratch: Floats  # (4,)
    coupled: Floats  # (2 n_contacts, 2 n_contacts + 3) linear system of coupled answers; empty for one contact
    other_state: Floats  # of bodies with phases, what is exchanged as a contact opens or closes: empty without phases,
    #                      else one array after the other in the shapes of parameters, momentum, jump, responses,
    #                      row_value, left_out
    maps: Floats  # flat (2, 2, n_dof, n_dof) per phase record: closing, opening; displacements, velocities


# Layers of `answers`: displacement (pushed rows: value) and velocity at the end of the step, velocity at once.
U_FORCE, V_FORCE, U_IMPULSE, V_IMPULSE, U_PROJECTION, V_PROJECTION, U_PUSH, V_PUSH, V_JUMP = range(9)
LAYERS = 9
SAMPLED = 6  # columns of a sample before those of the bodies
