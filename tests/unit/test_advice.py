"""One line for each kind of warning, with what to do about it."""

from impactlab.history.advice import ADVICE, warning_lines


def test_warnings_of_one_code_are_one_line_with_advice():
    given = [{"code": "no_contact", "text": f"a|b{i}: the faces never met"} for i in range(3)]
    lines = list(warning_lines([*given, {"code": "of_a_plugin", "text": "strange."}]))
    assert lines == [
        f"no_contact: a|b0: the faces never met (and 2 more). {ADVICE['no_contact']}",
        "of_a_plugin: strange.",
    ]
