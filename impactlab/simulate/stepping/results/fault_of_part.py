"""The part whose compiled code raised an exception in a run.

Its law is called again as plain Python.
"""

from __future__ import annotations

from impactlab.errors import StepError, raised_at
from impactlab.scene.method import laws_of
from impactlab.simulate.planning.preparation import FAULT_OF_LAW, law_raised
from impactlab.simulate.stepping.results.history import RecordedHistory
from impactlab.simulate.stepping.setup.assembly import Assembly
from impactlab.types import Reply


def fault_of_part(assembly: Assembly, raised: BaseException, history: RecordedHistory) -> StepError:
    """Return the error for an exception that compiled code raised.

    It was raised in the last step of the run. Compiled code keeps no line for some exceptions, such as a division by
    zero. A law that raises again as plain Python names its line; else the fault is that of the code that compiled code
    names.
    """
    history.finish()
    laws = laws_of(assembly.scene, assembly.acting)
    time, step = assembly.failed_at or (assembly.clock.time, assembly.clock.step)
    for number, port in zip(assembly.layout.solved, assembly.ports, strict=True):
        reply = Reply()
        reply.memory[:] = [*port.memory]
        try:
            type(laws[number]).respond(port, reply)
        except Exception as again:  # noqa: BLE001 - a stranger's code
            error = StepError(
                law_raised(laws[number], assembly.scene.contacts[number].name, again),
                time=time,
                step=step,
                history=history,
                remedy=FAULT_OF_LAW,
                path=f"contacts.{number}.law",
            )
            error.__cause__ = again
            return error
    text = f"the compiled code of a part raised {raised_at(raised)}"
    error = StepError(text, time=time, step=step, history=history, remedy="This is a fault of the part.")
    error.__cause__ = raised
    return error
