"""``tbatch methods``: the two-step scheme against others on one run of a scenario."""

import json
from pathlib import Path
from typing import Annotated

import typer

from tbatch.cli.app import AsJson, app, say


@app.command()
def methods(
    scenario: Annotated[str, typer.Argument(help="A scenario file, or a name that 'tbatch list scenarios' lists.")],
    out: Annotated[Path | None, typer.Option(metavar="DIR", help="Folder; default results/<name>-methods.")] = None,
    steps: Annotated[str | None, typer.Option(help="Steps to compare, such as '1 ms, 0.1 ms'.")] = None,
    reference: Annotated[
        str | None, typer.Option(help="Step of the reference, such as '2 us'; default a tenth of the shortest step.")
    ] = None,
    only: Annotated[str | None, typer.Option(help="Methods to compare, such as 'two-step, NML, NMN, APL'.")] = None,
    case: Annotated[int, typer.Option(min=0, help="Which speed of the scenario, from 0.")] = 0,
    sample: Annotated[int, typer.Option(min=0, help="Which sample, from 0.")] = 0,
    rrd: Annotated[Path | None, typer.Option(metavar="FILE", help="Write all responses as one recording.")] = None,
    direct: Annotated[
        bool, typer.Option("--direct", help="Let NML and APL factorise the coupled matrix at every step.")
    ] = False,
    change: Annotated[
        list[str] | None, typer.Option("--set", metavar="KEY=VALUE", help="Change a key, such as run.distance=10.")
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Compare two-step with NML, NMN and APL on one run: errors, times, work-precision."""
    from tbatch.methods.case import METHODS, Case
    from tbatch.methods.comparison import LADDER, compare
    from tbatch.methods.report import comparison_text, save_comparison
    from tbatch.numerics.step_advice import advice_table
    from tbatch.scenario import Scenario
    from tbatch.scenario.resolution import resolutions_of

    loaded = Scenario.load(scenario, overrides=list(change or []))
    for warning in loaded.warnings:
        say(f"warning: {warning}")
    runs, durations = loaded.runs([(case, sample)])
    model = loaded.model()
    compared = Case(
        name=loaded.name,
        model=model,
        speed=float(runs.speed[0]),
        irregularity=runs.irregularity[0],
        start=float(runs.start[0]),
        duration=float(durations[0]),
    )
    names = [name.strip() for name in only.split(",")] if only is not None else list(METHODS)
    ladder = _parsed(steps, "--steps") if steps is not None else LADDER
    fine = _parsed(reference, "--reference")[0] if reference is not None else None
    comparison = compare(compared, steps=ladder, methods=names, direct=direct, reference_step=fine, progress=say)
    folder = out or Path("results") / f"{loaded.name}-methods"
    written = save_comparison(comparison, folder)
    try:
        from tbatch.view.comparison import plot_comparison

        written += plot_comparison(comparison, folder)
    except ImportError:
        say("no plots: they need matplotlib; install it with: pip install 'tbatch[report]'")
    if rrd is not None:
        from tbatch.view.overlaid_methods import overlaid_methods
        from tbatch.view.timeline import write_overlay

        written.append(write_overlay(overlaid_methods(comparison), rrd))
    if as_json:
        print(json.dumps(json.loads(written[0].read_text(encoding="utf-8")), indent=1))
    else:
        print(comparison_text(comparison))
        print()
        print(advice_table(model.step, resolutions_of(loaded.document, model.vehicle, model.rest)))
    say("wrote " + ", ".join(str(path) for path in written))


def _parsed(steps: str, option: str) -> tuple[float, ...]:
    """Steps [s] from a list such as "1 ms, 1e-4"."""
    from tbatch.scenario.units import UnitError, to_si

    found = []
    for text in steps.split(","):
        try:
            step = to_si(text.strip(), "s") if any(map(str.isalpha, text.strip()[-1:])) else float(text)
        except (UnitError, ValueError):
            raise ValueError(
                f"{option}: {text.strip()!r} is no time; accepted are such as '0.1 ms' or 1e-4 [s]"
            ) from None
        if not 1e-7 <= step <= 1e-2:
            raise ValueError(f"{option}: {step:g} s is out of range; accepted are 1e-7 to 1e-2 s")
        found.append(step)
    return tuple(found)
