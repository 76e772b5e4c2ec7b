"""The commands: what they print, where, their exit codes, and what they write."""

from __future__ import annotations

import json
import math
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from impactlab import __version__, api, drilling, granular, piling
from impactlab.casefile import load_case
from impactlab.cli import quotes_for
from impactlab.errors import CaseError, ImpactlabError, StepError
from impactlab.report import output
from tests.support import ROOT, invoke

AXIAL = str(ROOT / "cases" / "axial_impact.yaml")


def test_help_answers_at_once():
    def once() -> float:
        # Processor time, so that a busy machine does not make the test fail; on an idle one it is the time one waits.
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([sys.executable, "-m", "impactlab", "--help"], check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    assert any(once() < 0.3 for _ in range(5))


def test_help_imports_nothing_heavy():
    done = subprocess.run(
        [sys.executable, "-X", "importtime", "-m", "impactlab", "--help"], check=True, capture_output=True, text=True
    )
    for name in ("numpy", "numba", "pydantic", "matplotlib", "pint", "rich.progress", "impactlab.casefile"):
        assert f"| {name}\n" not in done.stderr.replace(" " * 2, ""), name
    for command in ("run", "compare", "check", "schema", "plugins", "cite", "new"):
        assert f"  {command} " in done.stdout


def test_usage_errors_leave_with_2():
    for arguments in (["run", AXIAL, "--nonsense"], []):
        done = subprocess.run([sys.executable, "-m", "impactlab", *arguments], capture_output=True, text=True)
        assert done.returncode == 2, arguments
        assert "Traceback" not in done.stderr


def test_usage_errors_are_json_too():
    done = subprocess.run([sys.executable, "-m", "impactlab", "run", "--json"], capture_output=True, text=True)
    assert done.returncode == 2
    assert json.loads(done.stdout)["status"] == "refused"
    assert "CASE" in done.stderr


def test_run_prints_one_json_document():
    result = invoke("run", AXIAL, "--json")
    assert result.exit_code == 0, result.stderr
    summary = json.loads(result.stdout)
    assert summary["case"] == "axial_impact"
    assert summary["status"] == "completed"
    assert summary["method"]["laws"][0]["kind"] == "wave_identification"
    assert summary["errors"]["reference"] == "st_venant"


def test_run_takes_settings_and_methods():
    result = invoke("run", AXIAL, "--json", "--method", "modal_10", "--set", "solve.duration.round_trips=1")
    summary = json.loads(result.stdout)
    assert summary["method"]["models"]["rod"]["modes"] == 10
    assert summary["final"]["time"] == pytest.approx(116.37378e-6, rel=1e-6)


def test_run_compare_and_their_pages_take_a_variant(tmp_path):
    path = tmp_path / "pair.yaml"
    path.write_text(Path(AXIAL).read_text() + "\nvariants: {light: {bodies.hammer.mass: 1.0}}\n")
    summary = json.loads(invoke("run", str(path), "--variant", "light", "--method", "modal_10", "--json").stdout)
    assert summary["case"] == "pair/light"
    # The mass alone has energy at the start: 0.5 m v0^2.
    assert summary["energy"]["initial"] == pytest.approx(0.5, rel=1e-12)
    out = tmp_path / "out"
    chosen = "--methods", "modal_10,continuous", "--variant", "light"
    result = invoke("compare", str(path), *chosen, "--out", str(out), "--json")
    assert result.exit_code == 0, result.stderr
    assert [row["name"] for row in json.loads(result.stdout)["rows"]] == ["modal_10", "continuous"]
    assert json.loads(result.stdout)["case"] == "pair/light"
    assert f"impactlab compare pair.yaml {' '.join(chosen)}" in (out / "index.html").read_text()
    assert {path.name for path in tmp_path.iterdir()} == {"pair.yaml", "out"}, "no temporary folder remains"
    assert "Variants of this case: base, light." in invoke("check", str(path), "--variant", "dark").stderr


def test_run_prints_a_summary_for_people():
    result = invoke("run", AXIAL)
    assert result.exit_code == 0
    assert "axial_impact: completed" in result.stdout
    assert "hammer|rod.left" in result.stdout


def test_run_writes_its_folder_whole_and_the_page_repeats_it(tmp_path):
    out, law = tmp_path / "results", "contacts.0.law={kind: penalty, stiffness: 1e9}"
    arguments = [AXIAL, "--method", "modal_10", "--set", law, "--set", "solve.duration=1e-4"]
    result = invoke("run", *arguments, "--out", str(out), "--json")
    assert result.exit_code == 0, result.stderr
    assert (out / "summary.json").is_file()
    assert [path.name for path in tmp_path.iterdir()] == ["results"], "no temporary folder remains"
    settings = f"--set &#39;{law}&#39; --set solve.duration=1e-4 --method modal_10"
    page = (out / "index.html").read_text()
    assert f"# as this page was made\nimpactlab run axial_impact.yaml {settings} --out DIR\n# from case.yaml" in page
    assert "# its sources to cite, as BibTeX\nimpactlab cite case.yaml\n" in page


def test_compare_keeps_refused_rows():
    result = invoke(
        "compare", AXIAL, "--methods", "base,broken", "--set", "methods.broken={solve.step: {dt: -1}}", "--json"
    )
    assert result.exit_code == 0, result.stderr
    document = json.loads(result.stdout)
    assert document["reference"] == "st_venant"
    base, broken = document["rows"]
    assert (base["name"], base["summary"]["status"]) == ("base", "completed")
    assert (broken["name"], broken["summary"]["status"]) == ("broken", "refused")
    assert "-1 s is out of range" in broken["summary"]["error"]["text"]
    assert "broken refused:" in result.stderr


def test_compare_fails_when_every_method_does():
    result = invoke("compare", AXIAL, "--methods", "broken", "--set", "methods.broken={solve.step: {dt: -1}}", "--json")
    assert result.exit_code == 2
    assert json.loads(result.stdout)["rows"][0]["summary"]["status"] == "refused"


def test_compare_without_a_method_is_refused():
    """An empty table, with exit code 0."""
    result = invoke("compare", AXIAL, "--methods", "", "--json")
    assert result.exit_code == 2
    error = json.loads(result.stdout)["error"]
    assert error["text"] == "--methods names no method"
    assert error["remedy"].startswith("Methods of this case: base, ")


def test_check_prints_values_in_si():
    result = invoke("check", str(ROOT / "cases" / "free_rod.yaml"), "--json")
    assert result.exit_code == 0, result.stderr
    document = json.loads(result.stdout)
    assert document["resolved"]["bodies"]["rod"]["material"]["young"] == 2.1e11
    base = document["methods"]["base"]
    assert base["status"] == "accepted"
    assert base["dt"] * base["steps"] == pytest.approx(document["resolved"]["solve"]["duration"], rel=1e-2)
    text = invoke("check", str(ROOT / "cases" / "free_rod.yaml"))
    assert "young: 210000000000.0" in text.stdout


def test_check_lists_faults_of_keys_and_of_parts_together(tmp_path):
    text = (
        Path(AXIAL).read_text().replace("mass: 2.133", "mas: 2.133").replace("wave_identification", "wave_identity", 1)
    )
    (tmp_path / "bad.yaml").write_text(text)
    listed = invoke("check", str(tmp_path / "bad.yaml")).stderr
    assert "Did you mean 'mass'?" in listed
    assert "Did you mean 'wave_identification'?" in listed


def test_check_lists_every_refused_method(tmp_path):
    path = tmp_path / "case.yaml"
    path.write_text((ROOT / "cases" / "free_rod.yaml").read_text() + "  long: {solve.step: {dt: -1}}\n")
    result = invoke("check", str(path))
    assert result.exit_code == 2
    assert "solve.step.dt: -1 s is out of range" in result.stderr
    assert "status: refused" in result.stdout


def test_schema_is_json():
    assert json.loads(invoke("schema").stdout)["title"] == "impactlab case, format 1"


def test_plugins_lists_the_installed_parts():
    result = invoke("plugins")
    assert result.exit_code == 0
    assert "impactlab.contact_laws" in result.stdout
    assert "wave_identification" in result.stdout
    names = [part["name"] for part in json.loads(invoke("plugins", "--json").stdout)["parts"]]
    assert "newmark" in names


def test_cite_prints_bibtex():
    result = invoke("cite", AXIAL)
    assert "@article{EscalonaMayoDominguez1999," in result.stdout
    assert json.loads(invoke("cite", AXIAL, "--json").stdout)["keys"] == ["EscalonaMayoDominguez1999", "Newmark1959"]


@pytest.mark.parametrize("kind", ["hammer", "hopkinson"])
def test_cases_to_start_from_are_solved_exactly(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert "impactlab run mine.yaml" in invoke("new", "mine", "--like", kind).stderr
    assert "this is the exact solution" in invoke("run", "mine.yaml").stdout
    checked = invoke("check", "mine.yaml", "--json")
    assert {plan["status"] for plan in json.loads(checked.stdout)["methods"].values()} == {"accepted"}


@pytest.mark.parametrize("kind", ["pile", "drill"])
def test_starters_with_soil_or_rock_give_set_and_efficiency(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert invoke("new", "mine", "--like", kind).exit_code == 0
    checked = invoke("check", "mine.yaml", "--json")
    assert {plan["status"] for plan in json.loads(checked.stdout)["methods"].values()} == {"accepted"}
    summary = json.loads(invoke("run", "mine.yaml", "--json").stdout)
    assert summary["energy"]["largest_gain"] < 1e-3
    case = load_case("mine.yaml")
    if kind == "pile":
        blow = piling.blow(case)
        assert 5e-3 < (blow.set or 0.0) < 20e-3
        assert {each["name"]: each["set"] for each in summary["links"]}["toe"] == pytest.approx(blow.set)
    else:
        found = drilling.blow(case)
        kept = found.work + found.left_in_hammer + found.left_in_rods
        assert 0.5 < found.efficiency < 1.0
        assert kept == pytest.approx(found.work / found.efficiency, rel=5e-3)  # the rest is lost where faces close


@pytest.mark.parametrize("kind", ["ball", "beam"])
def test_cases_to_start_from_that_have_no_exact_solution_state_a_tolerance(kind, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert invoke("new", "mine", "--like", kind).exit_code == 0
    summary = json.loads(invoke("run", "mine.yaml", "--json").stdout)
    assert summary["choice"]["met"]
    assert not {"stocky_beam", "near_grazing"} & {warned["code"] for warned in summary["warnings"]}


def test_a_chain_to_start_from_carries_a_solitary_wave(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert invoke("new", "mine", "--like", "chain").exit_code == 0
    checked = invoke("check", "mine.yaml", "--json")
    assert {plan["status"] for plan in json.loads(checked.stdout)["methods"].values()} == {"accepted"}
    case = load_case("mine.yaml")
    wave = granular.leading_wave(api.run(case))
    expected = granular.wave_speed(7.69e9, 4.11e-3, float(wave.forces[20:40].mean()))
    assert wave.speed(20, 40) == pytest.approx(expected, rel=1e-3)  # of the discrete chain, as a fixed point


def test_an_arm_to_start_from_turns_freely_to_its_stop(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert invoke("new", "mine", "--like", "arm").exit_code == 0
    assert invoke("check", "mine.yaml", "--variant", "driven").exit_code == 0
    case = load_case("mine.yaml")
    (contact,) = api.run(case).contacts
    # At 60 rpm the end of the arm, 0.6 m from the hinge, has risen by 10 mm at the angle asin(1/60).
    assert contact.start == pytest.approx(math.asin(0.01 / 0.6) / (2.0 * math.pi), rel=1e-6)
    assert math.isfinite(contact.end)
    with pytest.raises(ImpactlabError, match="'arm' is a link of a mechanism, which has no fields"):
        api.run(case.with_("solve.duration", "1 ms")).field("arm", 0.0, "bending_moment")
    with pytest.raises(CaseError, match="the link 'arm' has no force to record"):
        case.with_("probes", [{"body": "arm", "at": 0.3, "quantity": "force"}])


def test_new_replaces_no_file_and_takes_no_path(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    assert invoke("new", "mine").exit_code == 0
    again = invoke("new", "mine")
    assert again.exit_code == 2
    assert "'mine.yaml' is already there" in again.stderr
    for name in ("../mine", "a/b", "", ".hidden"):
        assert invoke("new", name).exit_code == 2
    assert "Did you mean 'hopkinson'?" in invoke("new", "other", "--like", "hopkinsn").stderr
    assert [path.name for path in tmp_path.iterdir()] == ["mine.yaml"]


def test_cases_of_the_package_are_listed_printed_copied_and_run_by_name(tmp_path, monkeypatch):
    titles = json.loads(invoke("cases", "--json").stdout)["cases"]
    folder = Path(AXIAL).parent
    assert set(titles) == {str(file.relative_to(folder).with_suffix("")) for file in folder.rglob("*.yaml")}
    assert f"axial_impact                 {titles['axial_impact']}\n" in invoke("cases").stdout
    assert invoke("cases", "axial_impact").stdout == Path(AXIAL).read_text()
    monkeypatch.chdir(tmp_path)
    assert invoke("cases", "axial_impact", "--copy").exit_code == 0
    assert Path("axial_impact.yaml").read_text() == Path(AXIAL).read_text()
    assert invoke("run", "two_rods", "--method", "continuous").exit_code == 0
    wrong = invoke("run", "two_rod")
    assert (wrong.exit_code, "Did you mean 'two_rods'?" in wrong.stderr) == (2, True)
    assert invoke("run", "solitary_wav").stderr.endswith("Did you mean 'solitary_wave'?\n")
    Path("axial_impact.yaml").rename("mine.yaml")
    without_ending = invoke("run", "mine")
    assert (without_ending.exit_code, "Did you mean 'mine.yaml'?" in without_ending.stderr) == (2, True)


def test_help_cuts_no_description():
    listed = invoke("--help").stdout.partition("Commands:")[2]
    assert listed.count("\n") > 10
    assert "..." not in listed.replace("integrators, ...;", "")


def test_every_help_shows_examples():
    for command in ("run", "compare", "bench", "check", "choose", "new", "cases", "schema", "plugins", "cite"):
        assert f"  impactlab {command}" in invoke(command, "--help").stdout


def test_a_run_that_fails_leaves_with_1(monkeypatch, tmp_path):
    def fail(case, progress=None, frames=0):
        raise StepError("the law has no answer", time=1e-5, step=7)

    monkeypatch.setattr(api, "run", fail)
    result = invoke("run", AXIAL, "--json", "--out", str(tmp_path / "results"))
    assert result.exit_code == 1
    document = json.loads(result.stdout)
    assert document["status"] == "failed"
    assert document["reached"] == {"time": 1e-5, "step": 7}
    assert not list(tmp_path.iterdir())


def test_a_plugin_that_raises_leaves_with_1_and_no_traceback(monkeypatch):
    def fail(case, progress=None, frames=0):
        raise ZeroDivisionError("oh")

    monkeypatch.setattr(api, "run", fail)
    result = invoke("run", AXIAL, "--json")
    assert result.exit_code == 1
    assert "ZeroDivisionError: oh" in result.stderr
    assert "Traceback" not in result.output
    assert json.loads(result.stdout)["error"]["kind"] == "ZeroDivisionError"


def test_ctrl_c_leaves_with_130(monkeypatch, tmp_path):
    def interrupt(case, progress=None, frames=0):
        raise KeyboardInterrupt

    monkeypatch.setattr(api, "run", interrupt)
    result = invoke("run", AXIAL, "--out", str(tmp_path / "results"))
    assert result.exit_code == 130
    assert "interrupted" in result.stderr
    assert not list(tmp_path.iterdir())


def test_a_folder_of_somebody_else_is_never_replaced(tmp_path):
    mine = tmp_path / "mine"
    mine.mkdir()
    (mine / "thesis.tex").write_text("years of work")
    result = invoke("run", AXIAL, "--out", str(mine))
    assert result.exit_code == 2
    assert "holds files not written by impactlab, such as 'thesis.tex'" in result.stderr
    assert (mine / "thesis.tex").read_text() == "years of work"


def test_output_folder_is_all_or_nothing(tmp_path):
    out = tmp_path / "out"

    def fail() -> None:
        with output.output_folder(out) as draft:
            (draft / "half").write_text("x")
            raise RuntimeError

    with pytest.raises(RuntimeError):
        fail()
    assert not list(tmp_path.iterdir())
    for text in ("one", "two"):
        with output.output_folder(out) as draft:
            (draft / "whole").write_text(text)
        assert (out / "whole").read_text() == text
    assert [path.name for path in tmp_path.iterdir()] == ["out"]
    (out / "note").write_text("mine")
    with pytest.raises(CaseError, match="such as 'note'"), output.output_folder(out):
        pass


def test_output_folder_needs_a_place(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(CaseError, match="is not a folder"):
        output.check_target(tmp_path / "file")
    with pytest.raises(CaseError, match="there is no folder"):
        output.check_target(tmp_path / "no" / "such")


def test_an_output_folder_that_cannot_be_written_is_refused_before_the_run(tmp_path, monkeypatch):
    """The run was done and its figures drawn before the folder was looked at; the fault was called one of impactlab."""

    def read_only(**_options):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(output.tempfile, "mkdtemp", read_only)
    monkeypatch.setattr(api, "run", lambda *_: pytest.fail("a run was started"))
    result = invoke("run", AXIAL, "--out", str(tmp_path / "out"))
    assert result.exit_code == 2
    assert f"the folder '{tmp_path}' cannot be written: Permission denied" in result.output
    assert "Give another --out." in result.output
    with pytest.raises(CaseError, match="cannot be written"):  # of a fit or a bench, whose folders are made whole
        output.check_writable(tmp_path / "no" / "such")


def test_several_settings_are_checked_once_all_are_in_place():
    """A law that needs a constant is named by one setting and given it by the next."""
    settings = ["--set", "contacts.0.law.kind=hertz", "--set", "contacts.0.law.stiffness=2.0e13"]
    result = invoke("check", AXIAL, *settings, "--json")
    assert result.exit_code == 0, result.output
    assert json.loads(result.stdout)["resolved"]["contacts"][0]["law"]["stiffness"] == 2.0e13


def test_loading_compiled_code_is_timed_as_solving(monkeypatch):
    """Nothing is left to load, or to compile, when the clock of an exact run starts."""
    from impactlab.exact import march
    from impactlab.numerics.addresses import COMPILED
    from impactlab.numerics.compiling import EXACT_ENTRY

    loaded_at_first_call: list[bool] = []
    real = march.march

    def spied(log):
        loaded_at_first_call.append(not COMPILED or bool(march.advance.overloads))
        return real(log)

    if COMPILED:  # as in a fresh process
        monkeypatch.setattr(march, "advance", EXACT_ENTRY(march.advance.py_func))
    monkeypatch.setattr(march, "march", spied)
    api.run(load_case(AXIAL).method("continuous"))
    assert loaded_at_first_call[0]


def test_the_version_is_that_of_the_package():
    done = invoke("--version")
    assert (done.exit_code, done.stdout) == (0, f"impactlab {__version__}\n")


def test_a_page_that_cannot_be_drawn_leaves_the_data_of_the_run(tmp_path, monkeypatch):
    def fails(*_: object) -> None:
        raise RuntimeError("no ink")

    monkeypatch.setattr("impactlab.report.run_report.write_run", fails)
    out = tmp_path / "out"
    done = invoke("run", "axial_impact", "--method", "continuous", "--out", str(out))
    assert done.exit_code != 0
    assert "could not be drawn" in done.stderr
    assert {"history.nc", "probes.csv", "contacts.csv"} <= {each.name for each in out.iterdir()}


def test_figures_without_a_folder_are_refused():
    done = invoke("run", "axial_impact", "--figures", "png")
    assert done.exit_code == 2
    assert "--figures without --out" in done.stderr


def test_an_output_that_lacks_a_letter_gets_a_replacement(tmp_path: Path) -> None:
    """The table of a comparison ended with a UnicodeEncodeError; JSON escapes the letter."""
    file = tmp_path / "case.yaml"
    title = "title: Axial impact"
    file.write_text(Path(AXIAL).read_text().replace(title, f"{title} \u2013"), encoding="utf-8")
    posix = {**os.environ, "PYTHONCOERCECLOCALE": "0", "PYTHONUTF8": "0", "LC_ALL": "POSIX"}
    for arguments in (["compare", file, "--methods", "continuous"], ["check", file, "--json"]):
        done = subprocess.run([sys.executable, "-m", "impactlab", *arguments], capture_output=True, env=posix)
        assert done.returncode == 0, done.stderr.decode()
        if "--json" in arguments:
            assert "\u2013" in json.loads(done.stdout)["resolved"]["title"]
        else:
            assert b"  ?  " in done.stdout


@pytest.mark.skipif(not Path("/dev/full").exists(), reason="needs /dev/full")
@pytest.mark.parametrize("arguments", [["run", AXIAL], ["run", "no.yaml", "--json"]])
def test_an_output_on_a_full_disk_gives_one_message(arguments: list[str]) -> None:
    """It ended with a traceback of 59 lines."""
    with Path("/dev/full").open("w") as full:
        done = subprocess.run(
            [sys.executable, "-m", "impactlab", *arguments], stdout=full, stderr=subprocess.PIPE, text=True
        )
    assert done.returncode == 1
    assert "Traceback" not in done.stderr
    assert "Exception ignored" not in done.stderr
    told = "the output could not be written: [Errno 28] No space left on device\nMake room, or write elsewhere.\n"
    assert done.stderr.endswith(told)
    assert done.stderr.count(told) == 1


@pytest.mark.parametrize(
    ("arguments", "advice"),
    [
        ("run a.yaml --set bodies.rod.length=3 mm", "needs quotes: --set 'bodies.rod.length=3 mm'."),
        ("run --set bodies.rod.length=3 a.yaml --foo", ""),
        ("run --set bodies.rod.length=3 axial_impact --foo", ""),
    ],
)
def test_a_value_whose_unit_the_shell_split_off_is_named_with_its_quotes(arguments, advice):
    """It was answered with "unexpected extra argument(s) (mm)"."""
    assert quotes_for(arguments.split()).endswith(advice)
    assert bool(quotes_for(arguments.split())) == bool(advice)
