"""Equations of motion of a planar chain of links at one state.

Compiled code gives mass matrix, forces and readings.

M(p) p'' = force + rows^T F. Link by link: the integrals of a link give mass and inertia forces in its frame; the rows
of its origin and of its angle carry them to the coordinates of the chain. Its end is the origin of the next link.

References
----------
KaneRyanBanerjee1987. The derivation is in docs/mechanisms.md.
"""

from __future__ import annotations

import math

from impactlab.mechanisms.inertia import add_link, contract, twist
from impactlab.mechanisms.layout import (
    ACROSS,
    ANGLE,
    ANGLE_AT,
    AXIAL,
    BENDING,
    COORDINATES,
    COS,
    FIRST,
    FIXED,
    KIND,
    LENGTH,
    LINKS,
    LINKS_AT,
    NEXT,
    OF_LINK,
    OWN,
    PLACE,
    READING,
    READINGS,
    READINGS_AT,
    ROOM_AT,
    ROWS,
    SHORTENED,
    SIN,
    SLIDING,
    TH,
    TH1,
    TH2,
    TO_X,
    TO_Y,
    TORQUE,
    TURN,
    TURNED,
    XI,
    X,
    Y,
    add,
    constants,
    contracted,
    dot,
    size_of,
    spot,
    work_of,
)
from impactlab.mechanisms.places import follow, slide, write_place, write_row
from impactlab.numerics.compiling import PART
from impactlab.numerics.windows import window
from impactlab.types import Array


@PART
def set_link_angle(P: Array, link: int, before: int, room: int, old: int, n: int, p: Array, v: Array) -> None:
    """Give a link the angle of its coordinate or of the end before it; on a slide, later."""
    turn = window(P, room + ROWS + 2 * n, n)
    if P[link + ANGLE] == OWN:
        at = int(P[link + ANGLE_AT])
        P[room + TH], P[room + TH1] = p[at], v[at]
        turn[at] = 1.0
    elif P[link + ANGLE] == FIXED:
        na, nb, first = int(P[before + AXIAL]), int(P[before + BENDING]), int(P[before + FIRST])
        slopes = constants(P, before).slopes
        add(turn, 1.0, window(P, old + ROWS + 2 * n, n))
        add(window(turn, first + na, nb), 1.0, slopes)
        P[room + TH] = P[old + TH] + P[link + TURN] + dot(slopes, window(p, first + na, nb))
        P[room + TH1] = dot(turn, v)
        P[room + TH2] = P[old + TH2]


@PART
def read(P: Array, n: int, p: Array, v: Array, rows: Array, values: Array, rates: Array) -> None:
    """Write rows, values and rates of all readings."""
    size, first_room = size_of(n), int(P[ROOM_AT])
    place_at = first_room + int(P[LINKS]) * size
    reading = int(P[READINGS_AT])
    for number in range(int(P[READINGS])):
        link = int(P[LINKS_AT])
        for _ in range(int(P[reading + OF_LINK])):
            link = int(P[link + NEXT])
        room, row = first_room + int(P[reading + OF_LINK]) * size, window(rows, number * n, n)
        if P[reading + KIND] == SHORTENED:
            na, nb, first = int(P[link + AXIAL]), int(P[link + BENDING]), int(P[link + FIRST])
            slopes = window(spot(P, room + ROWS + 3 * n, na + nb).along, na, nb)  # minus S q at the end
            values[number] = -0.5 * dot(slopes, window(p, first + na, nb))
            for i in range(n):
                row[i] = 0.0
            add(window(row, first + na, nb), -1.0, slopes)
            reading += READING
        elif P[reading + KIND] == TURNED:
            values[number] = P[room + TH]
            turn = window(P, room + ROWS + 2 * n, n)
            for i in range(n):
                row[i] = turn[i]
            reading += READING
        else:
            nb, first = int(P[link + BENDING]), int(P[link + FIRST])
            m, shapes = int(P[link + AXIAL]) + nb, reading + READING
            bb = nb * nb
            place = spot(P, room + ROWS + 3 * n, m)
            if P[reading + PLACE] != P[link + LENGTH]:
                place = spot(P, place_at, m)
                sq = window(place.along, m - nb, nb)
                contracted(window(P, shapes + m, bb), nb, window(p, first + m - nb, nb), sq)
                write_place(P, link, window(P, shapes, m), sq, window(sq, 0, 0), P[reading + PLACE], p, v, room, place)
            write_row(P, link, room, place, P[reading + TO_X], P[reading + TO_Y], row)
            c, s = P[room + COS], P[room + SIN]
            here_x = P[room + X] + c * place.at[XI] - s * place.at[ACROSS]
            here_y = P[room + Y] + s * place.at[XI] + c * place.at[ACROSS]
            values[number] = P[reading + TO_X] * here_x + P[reading + TO_Y] * here_y
            reading = shapes + m + bb
        rates[number] = dot(row, v)


@PART
def chain_terms(
    P: Array, _t: float, p: Array, v: Array, mass: Array, force: Array, rows: Array, values: Array, rates: Array
) -> None:  # fmt: skip
    """Write mass matrix, force and readings of a chain at a state.

    They are the mass matrix (n n,), the force (n,), and rows (n_readings n,), values and rates of the readings. After
    the values stands the work of loads that follow from the position [J]. With an empty mass matrix only the readings
    are written. The time ``_t`` [s] is for mechanisms whose loads change with it; here none does.
    """
    n, links = int(P[COORDINATES]), int(P[LINKS])
    size, first_room = size_of(n), int(P[ROOM_AT])
    place_at = first_room + links * size
    for i in range(mass.size):
        mass[i] = 0.0
    for i in range(n):
        force[i] = 0.0
    for i in range(first_room, place_at):
        P[i] = 0.0
    done = 0.0
    link, before = int(P[LINKS_AT]), int(P[LINKS_AT])
    for number in range(links):
        room = first_room + number * size
        old = room - size if number > 0 else room
        na, nb = int(P[link + AXIAL]), int(P[link + BENDING])
        k = constants(P, link)
        if number > 0:
            ends = spot(P, old + ROWS + 3 * n, int(P[before + AXIAL]) + int(P[before + BENDING]))
            follow(P, before, old, room, n, ends)
            ma, mb, at = int(P[before + AXIAL]), int(P[before + BENDING]), int(P[before + FIRST])
            turn, q = window(P, old + ROWS + 2 * n, n), window(p, at + ma, mb)
            done += twist(-P[link + TORQUE], constants(P, before).slopes, P[old + TH], turn, q, at + ma, force)
        set_link_angle(P, link, before, room, old, n, p, v)
        w = work_of(P, place_at, na, nb, n)
        first = int(P[link + FIRST])
        contract(k, w, window(p, first, na + nb), window(v, first, na + nb), na, mass.size > 0)
        sq, sd = window(w.s, 0, nb), window(w.sd, 0, nb if mass.size > 0 else 0)
        end = spot(P, room + ROWS + 3 * n, na + nb)
        write_place(P, link, k.end, sq, sd, P[link + LENGTH], p, v, room, end)
        if P[link + ANGLE] == SLIDING:
            slide(P, link, room, n, end, v)
            write_place(P, link, k.end, sq, sd, P[link + LENGTH], p, v, room, end)
        else:
            P[room + COS], P[room + SIN] = math.cos(P[room + TH]), math.sin(P[room + TH])
        if mass.size > 0:
            done += add_link(P, link, room, k, w, end, p, v, mass, force)
        before = link
        link = int(P[link + NEXT])
    read(P, n, p, v, rows, values, rates)
    values[int(P[READINGS])] = done


def terms(
    P: Array, t: float, p: Array, v: Array, mass: Array, force: Array, rows: Array, values: Array, rates: Array
) -> None:  # fmt: skip
    """Write the terms of a chain: see `chain_terms`.

    That is compiled without the runtime that counts references.
    """
    chain_terms(P, t, p, v, mass, force, rows, values, rates)
