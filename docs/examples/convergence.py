"""
Error against elements
======================

A mass strikes a bar of steel and brass, by central difference at two steps and by
Moreau-Jean stepping. The error of its displacement falls with the mesh; on a uniform bar
the step :math:`c\\,\\Delta t = h` would be exact by accident, which is why this one has
two materials.
"""

import numpy as np
from matplotlib import pyplot as plt

import impactlab as il

base = il.load_case("two_material_rod")
exact = il.run(base.method("continuous"))
t = np.linspace(0.0, exact.duration, 2000)
truth = exact.evaluate(t, "position:hammer")
schemes = {
    "central difference, step 1": ({"mass": "lumped"}, "central_difference", 1.0),
    "central difference, step 0.5": ({"mass": "lumped"}, "central_difference", 0.5),
    "Moreau-Jean, step 0.5": ({}, "moreau_jean", 0.5),
}
fig, axis = plt.subplots(figsize=(8, 3.6))
elements = (10, 20, 40, 80, 160, 320)
for name, (mesh, scheme, courant) in schemes.items():
    errors = []
    for number in elements:
        case = base.with_("contacts.0.law", kind="addition_deletion").with_(
            "solve.integrator", kind=scheme
        )
        case = case.with_("solve.model", kind="finite_element", elements=number, **mesh).with_(
            "solve.step", courant=courant
        )
        found = il.run(case).evaluate(t, "position:hammer")
        errors.append(np.linalg.norm(found - truth) / np.linalg.norm(truth))
    rate = -np.polyfit(np.log(elements), np.log(errors), 1)[0]  # of the fitted power of h
    axis.loglog(elements, errors, "o-", label=f"{name}: rate {rate:.2f}")
axis.set(
    xlabel="elements",
    ylabel="relative error of the displacement",
    title="A mass on a bar of two materials",
)
axis.legend(frameon=False)
