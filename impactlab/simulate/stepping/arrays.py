"""Arrays of the step loop: named records and flat arrays, allocated before the first step.

A record is a C structure that the compiled loop and plain Python read and write under the same names.
"""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from typing import Annotated, NamedTuple

from impactlab.numerics.tables import by_table
from impactlab.structures import Integers, Numbers, record
from impactlab.types import Array, Ints, Port, Reply

FEW = 4  # entries of the state that a force changes at a node of a lumped mesh, or on a rigid mass


@record
class BodyRecord(ctypes.Structure):
    """One body: addresses of its stepper's functions, and its ranges in the flat arrays."""

    free: int  # addresses
    measure: int
    retime: int
    derive: int
    columns: int  # 0 where the columns are the same in every step
    parameter_start: int
    parameter_end: int
    state_start: int
    state_end: int
    n_dof: int
    n_ports: int
    jump_start: int
    jump_end: int
    loads_end: int
    load_at: int  # in the parameters
    response_start: int
    has_row: int  # 0 of a body whose momentum row is zero, as the stepper measures the momentum
    even: float  # N s, entry of the momentum row shared by all coordinates but the outer two; 0 where they differ


@record
class FaceRecord(ctypes.Structure):
    """One side of a contact: two to a contact, left then right."""

    body: int
    place: int  # which of its body's faces
    low: Annotated[Integers, 9]  # ranges of nonzero response to a force, an impulse, a projection: of displacements,
    high: Annotated[Integers, 9]  # velocities and the rest (last index)
    moves: int  # 0 of a wall, which has no state
    few: int  # entries of the state that a force changes, where they are at most `FEW`; else -1
    index: Annotated[Integers, FEW]  # which, and by how much per force
    per_force: Annotated[Numbers, FEW]
    u_at: int  # entries of the state that are its displacement and velocity; -1 where they are sums over several
    v_at: int
    sign: float  # direction of the push: -1 left, +1 right
    u: float  # m, at the start of the step
    v: float  # m/s
    free_u: float  # m, at the end without contact
    free_v: float  # m/s


@record
class ContactRecord(ctypes.Structure):
    """One contact: its law, the present forces and the sums for records and events."""

    law: int  # address
    dates: int  # 1 if closings and openings are interpolated: the law replies by a force
    compliant: int  # 1 if faces that overlap may store energy
    projects_first: int  # 1 where a projection moves the scheme's predictor, 0 the end of the step
    load_point: float  # where in the step the force acts: 0 start, 1/2 mean over the step, 1 end
    trial_point: float  # where in the step the trial force belongs
    initial_gap: float  # m
    force: float  # N, of the last step
    before: float  # N, of the step before
    impulse: float  # N s
    projection: float  # kg m
    push: float
    left_share: float  # share of the offset that belongs to the left face
    old_gap: float  # m, one step before
    old_trial: float  # N
    touching: float  # 1 where a located touch begins this step
    zero_apart: int  # 1 if its law is not evaluated in a step that begins and ends apart, as the one before it did
    apart: int  # 1 if the last step began and ended apart
    skipped: int  # 1 if its law was not evaluated in this step: its last reply, of zero, stands
    span_impulse: float  # N s, of the contact under way
    span_peak: float  # N
    last_event: float  # s
    sum_force: float  # N s, since the last record
    total: float  # N s, force times time and impulses, since t = 0
    negative: float  # J, sum of the negative losses of the replies; zero by contract
    joined: int  # 1 for a link, whose force has either sign from t = 0
    first_pair: int  # range of its pairs: the contacts that may act on it
    last_pair: int
    coupled: int  # how many of them do
    moved: int  # sweep of this step in which its reply changed last
    largest: float  # N, so far
    smallest: float  # N, so far
    lost: float  # J, so far


@record
class BeadRowRecord(ctypes.Structure):
    """A row of rigid masses, each in contact with the next by a `PowerForce`.

    See `beads`.
    """

    body: int  # the first bead's number among the bodies; the others follow
    count: int  # of beads
    first: int  # entry and slot in the arrays of beads and of bead contacts; see `beads`
    contact: int  # the first contact among those of all rows: from left to right
    left_wall: int  # 1 if the first contact is with a wall
    right_wall: int
    exponent: float
    gained: float  # m/s, by gravity in a step
    watched: float  # N, force above which a step may be long against the contact's own time


@record
class ReadingRecord(ctypes.Structure):
    """A reading of a law: its body, its contact, and its slot in the port."""

    body: int
    contact: int
    slot: int


@record
class PushRecord(ctypes.Structure):
    """A row along which a contact may push a body, beside its force."""

    contact: int
    body: int
    place: int
    low: Annotated[Integers, 3]  # as of a face: ranges of the state with nonzero response
    high: Annotated[Integers, 3]
    weight: float


@record
class LoadRecord(ctypes.Structure):
    """A force over time on an end of a body, with its impulse and work."""

    body: int
    place: int  # which of its body's ports
    table_start: int  # in the times and forces of the samples
    table_end: int
    piece: int  # sample before the present time; -1 before the first
    low: Annotated[Integers, 3]  # as of a face: ranges of the state with nonzero response
    high: Annotated[Integers, 3]
    point: float  # middle of the time, as long as a step, of its mean: 0 start of the step, 1/2 its middle, 1 its end
    force: float  # N, of the last step
    before: float  # N, of the step before it
    u: float  # m, of its end, at the start of the step
    v: float  # m/s
    impulse: float  # N s so far
    work: float  # J so far


@record
class PhaseRecord(ctypes.Structure):
    """A body with other coordinates while a contact is closed; see `StepArrays.other_state`."""

    contact: int
    body: int
    closed: int
    map_start: int


@record
class DamperRecord(ctypes.Structure):
    """Dashpots side by side, from consecutive coordinates to consecutive others, or to the ground."""

    first: int  # in `dashpots`
    count: int
    index: int  # entry of the state that the first one moves with
    other: int  # that of its other end; -1 for the ground
    inside: int  # 1 for damping inside the body, 0 for a dashpot at its end
    straddles: int  # 1 if they act on the mean velocity of this step and the one before (leapfrog)
    rates: int  # entries from a coordinate to its velocity, and on to its acceleration; 0 if their loss needs neither
    gamma: float  # of `impactlab.integrators.base.Losses`
    kappa: float  # s2
    lag: float
    am: float


@record
class EventRecord(ctypes.Structure):
    """One event, with impulse and peak of the contact period that it ends."""

    time: float  # s
    contact: int
    kind: int  # see `event_times`
    impulse: float  # N s
    span_impulse: float
    span_peak: float


@record
class SnapshotRecord(ctypes.Structure):
    """A snapshot: its time, the instants around it, and the closed phases there.

    Bit n of a number of closed phases stands for phase n.
    """

    time: float
    before: float
    after: float
    closed_before: int
    closed_after: int


@record
class ClockRecord(ctypes.Structure):
    """State that continues between calls of the loop: time, counters, booked losses."""

    time: float
    step: int
    steps: int  # of the whole run
    ends: float  # s, the end of the last step, where steps may be cut
    n_records: int
    n_samples: int
    n_events: int
    n_snapshots: int
    lost_contact: float  # J booked so far
    lost_ends: float  # J
    lost_inside: float  # J, by damping inside bodies
    lost_unresolved: float  # J, to modes that are left out
    lost_in_maps: float  # J, the part of it that changes of coordinates drop
    n_maps: int  # changes of coordinates so far, of bodies whose coordinates follow a contact
    timed: float  # s, the step length that the steppers are prepared for
    recorded: float  # s, time of the last record
    changes: int  # 1 where the columns of a body change with its state
    rare: int  # 1 where a step has more to read than faces: readings of laws, pushed rows, loads, dashpots
    reach: int  # largest distance in the linear system of contacts that may act on each other
    bead_columns: int  # of a record: forces of bead contacts and motion of beads
    only_beads: int  # 1 where nothing but rows of beads and walls is there
    failed_bead: int  # 1 + number of the bead contact that failed, 0 if none


@by_table
class StepArrays(NamedTuple):
    """All arrays of the loop.

    Rows of `row_index` and `row_value`: face displacements, face velocities, readings, probes and waves that are
    recorded, displacement and velocity of each loaded end, pushes.
    """

    clock: Sequence[ClockRecord]  # (1,)
    bodies: Sequence[BodyRecord]  # (n_bodies,)
    faces: Sequence[FaceRecord]  # (2 n_contacts,)
    contacts: Sequence[ContactRecord]  # (n_contacts,) without those of beads
    ports: Sequence[Port]  # (n_contacts,)
    replies: Sequence[Reply]  # (n_contacts,)
    readings: Sequence[ReadingRecord]  # (n_readings,)
    pushes: Sequence[PushRecord]  # (n_pushes,)
    loads: Sequence[LoadRecord]  # (n_loads,)
    phases: Sequence[PhaseRecord]  # (n_phases,)
    dampers: Sequence[DamperRecord]  # (n_groups,) groups of dashpots
    dashpots: Array  # (5, n_dashpots) in the layers below
    bead_rows: Sequence[BeadRowRecord]  # (n_rows,)
    events: Sequence[EventRecord]  # (room,)
    snapshots: Sequence[SnapshotRecord]  # (n_snapshots,)
    beads: Array  # (5, n_entries) in the layers below
    bead_contacts: Array  # (12, n_entries) in the layers below
    shared: Ints  # pairs: where the state of a bead begins that something else moves, too, and its entry
    called: Ints  # (n_called,) numbers of the bodies whose steppers are called: all but beads and walls
    parameters: Array  # flat, of all steppers
    state: Array  # flat
    backup: Array  # room for a step to be taken again
    momentum: Array  # row over the state, N s
    jump: Array  # flat, body by body: velocities per impulse of each face, then its loads: see `write_columns`
    responses: Array  # flat, body by body: (3, n_ports, n_state) to a force, an impulse and a projection at each port
    candidates: Ints  # (n_pairs,) contact by contact, those that may act on its faces: they share a body, or are itself
    coupled: Ints  # (n_pairs,) contact by contact, those that do, in the first places of its range
    influence: Array  # (n_pairs, 3, 9) of these on left face, right face and pushed row: layers
    own_influence: Array  # (3, 9) room for that of a contact on itself
    row_start: Ints  # (n_rows + 1,)
    row_index: Ints  # into the state
    row_value: Array
    probe_at: Ints  # (n_recorded,) entry of the state that each probe or wave is; -1 where it is a sum over several
    load_times: Array  # s, samples of the loads, one after the other
    load_forces: Array  # N
    left_out: Array  # (n_readings, n_contacts) static response of the modes left out per force of the step before
    record: Array  # (room, n_columns) time; of each contact force, gap, left u, v, right u, v; forces of bead contacts;
    #                 u, v of beads; probes
    sample: Array  # (room, 6 + 3 n_bodies) time, stored, four losses; energy, work, momentum of each body
    snapshot_state: Array  # (n_snapshots, 2, n_state)
    scratch: Array  # (4,)
    pieces: Ints  # addresses of the pieces of the loop that few scenes need, in the order below; see `unfilled`
    order: Ints  # (n_contacts,) place of each contact in the linear system, in which coupled ones stand close together
    system: Array  # (2 n_contacts, width + 2) banded, of coupled contacts: see `solve_banded`; empty for one
    other_state: Array  # values exchanged as a contact of a body with phases opens or closes: empty without phases,
    #                      else one array after the other in the shapes of parameters, momentum, jump, responses,
    #                      row_value, left_out
    maps: Array  # flat (2, 2, n_dof, n_dof) per phase record: closing, opening; displacements, velocities


# Layers of `beads`: dt over mass [s/kg], constant load [N], mass [kg], displacement [m], velocity [m/s].
# Layers of `bead_contacts`: gap at t = 0 [m], K, forces of all steps since the last record [N], largest force of the
# contact under way [N], forces of its steps before the last record [N], forces of all steps before it [N], compliance
# of the gap over a step [m/N], the values of it times the tangent stiffness that are coarse and too large, number of
# coarse steps, force of the last step [N], 1 at the first slot of a block that nothing has reached.
KICK, LOAD, MASS, U, V = range(5)
GAP, STIFFNESS, RECENT, PEAK, SPAN, TOTAL, COMPLIANCE, COARSE, MOST, COUNT, FORCE, REST = range(12)

# Layers of `dashpots`: damping [N s/m], length at the start of the step [m], change of it in the step before [m], rate
# of the length at the start of the step [m/s], its product with the acceleration [m2/s3]. Where the loss follows from
# rates, the change is z of `impactlab.integrators.base.Losses` [m/s].
DAMPING, LENGTH, CHANGE, RATE, PRODUCT = range(5)

# Pieces of the loop that are called by address (`pieces`).
SOLVE_SEVERAL, CHANGE_PHASES, REWRITE_COLUMNS, READ_AGAIN, STEP_ROWS, RECORD_ROWS, SAMPLE_ROWS = range(7)
MARCH_ROWS, READ_ROWS, SHOW_ROWS, READ_READINGS, READ_PUSHED, PUSH_ROWS = range(7, 13)
READ_LOADS, APPLY_LOADS, BOOK_LOADS, READ_LENGTHS, BOOK_DASHPOTS = range(13, 18)
PIECES = 18

# Layers of `influence`: displacement (pushed rows: value) and velocity at the end of the step, velocity at once.
U_FORCE, V_FORCE, U_IMPULSE, V_IMPULSE, U_PROJECTION, V_PROJECTION, U_PUSH, V_PUSH, V_JUMP = range(9)
LAYERS = 9
SAMPLED = 6  # columns of a sample before those of the bodies
SAMPLES = 256  # energies taken over a run, at most
