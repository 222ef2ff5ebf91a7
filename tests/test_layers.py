"""Imports run one way, heavy packages stay where they belong, and `import tbatch` is light."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import tbatch

PACKAGE = Path(tbatch.__file__).parent
LAYERS = ("physics", "numerics", "engine", "methods", "scenario", "campaign", "view", "cli")
"""From the bottom up; each may use what stands before it."""
HEAVY = ("taichi", "rerun", "matplotlib", "pyarrow", "pydantic", "scipy", "pint")
HOMES = {
    "taichi": ("tbatch.engine.kernels", "tbatch.engine.runtime", "tbatch.engine.frontend"),
    "rerun": ("tbatch.view.timeline",),
    "matplotlib": ("tbatch.view",),
    "pyyeti": ("tbatch.physics.substructure.nastran",),
    "threadpoolctl": ("tbatch.numerics.one_thread",),
}
"""The only modules that may import a package, inside functions too."""


def module_name(path: Path) -> str:
    """The dotted name of a module of the package."""
    parts = ["tbatch", *path.relative_to(PACKAGE).with_suffix("").parts]
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def imports(path: Path) -> list[tuple[str, int, bool]]:
    """What a module imports: names, lines, and whether it does so only for type checkers."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    checked_only = set()
    for node in ast.walk(tree):
        if isinstance(node, ast.If) and "TYPE_CHECKING" in ast.unparse(node.test):
            checked_only |= {id(inner) for statement in node.body for inner in ast.walk(statement)}
    found = []
    name = module_name(path)
    package = name if path.name == "__init__.py" else name.rpartition(".")[0]
    for node in ast.walk(tree):
        only = id(node) in checked_only
        if isinstance(node, ast.Import):
            found += [(alias.name, node.lineno, only) for alias in node.names]
        elif isinstance(node, ast.ImportFrom):
            base = node.module or ""
            if node.level:
                above = package.split(".")[: len(package.split(".")) - node.level + 1]
                base = ".".join([*above, base] if base else above)
            # `from package import module` names the module, not the package.
            found += [(f"{base}.{alias.name}", node.lineno, only) for alias in node.names]
        elif isinstance(node, ast.Call) and ast.unparse(node.func) in ("import_module", "importlib.import_module"):
            first = node.args[0] if node.args else None
            if isinstance(first, ast.Constant) and isinstance(first.value, str):
                found.append((first.value, node.lineno, only))
    return found


def layer(name: str) -> str | None:
    """The layer that a dotted name belongs to; None for the package's root and for other packages."""
    parts = name.split(".")
    return parts[1] if parts[0] == "tbatch" and len(parts) > 1 and parts[1] in LAYERS else None


MODULES = sorted(PACKAGE.rglob("*.py"))


def test_every_layer_is_there():
    assert {layer(module_name(path)) for path in MODULES} >= set(LAYERS)


@pytest.mark.parametrize("own", LAYERS)
def test_imports_run_one_way(own):
    wrong = [
        f"{path.relative_to(PACKAGE)}:{line} imports {name}"
        for path in MODULES
        if layer(module_name(path)) == own
        for name, line, _ in imports(path)
        if layer(name) is not None and LAYERS.index(layer(name) or "") > LAYERS.index(own)
    ]
    assert wrong == []


@pytest.mark.parametrize("package", HOMES)
def test_heavy_packages_stay_at_home(package):
    strangers = [
        f"{path.relative_to(PACKAGE)}:{line}"
        for path in MODULES
        if not module_name(path).startswith(HOMES[package])
        for name, line, _ in imports(path)
        if name.split(".")[0] == package
    ]
    assert strangers == []


def test_the_lowest_layers_need_numpy_and_scipy_alone():
    allowed = {"numpy", "scipy", "tbatch", *sys.stdlib_module_names}
    wrong = [
        f"{path.relative_to(PACKAGE)}:{line} imports {name}"
        for path in MODULES
        if layer(module_name(path)) in ("physics", "numerics")
        for name, line, _ in imports(path)
        if name.split(".")[0] not in allowed and not module_name(path).startswith(HOMES.get(name.split(".")[0], ()))
    ]
    assert wrong == []


def test_no_module_s_name_says_nothing():
    vague = {"utils", "common", "core", "manager", "helpers"}
    assert [path for path in MODULES if path.stem in vague or path.parent.name in vague] == []


def in_a_fresh_process(code: str) -> str:
    """What a piece of code prints in a process of its own."""
    child = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert child.returncode == 0, child.stderr
    return child.stdout


def test_import_tbatch_is_light():
    code = f"import sys, tbatch; print(*[name for name in {HEAVY} if name in sys.modules])"
    assert in_a_fresh_process(code).split() == []


def test_models_are_built_without_the_engine_s_compiler():
    code = (
        "import sys, tbatch as tb\n"
        "vehicle, track = tb.Vehicle.column('koh-column'), tb.Track.winkler('koh-winkler', length=20.0)\n"
        "tb.Model.build(vehicle, track, tb.Contact.hertz(), step=1e-4).describe()\n"
        "print(*[name for name in ('taichi', 'rerun', 'matplotlib', 'pyarrow', 'pydantic') if name in sys.modules])"
    )
    assert in_a_fresh_process(code).split() == []


def test_every_public_name_is_there():
    code = "import tbatch\nfor name in tbatch.__all__: getattr(tbatch, name)\nprint(len(tbatch.__all__))"
    assert int(in_a_fresh_process(code)) >= 10
    assert set(tbatch.__all__) <= set(dir(tbatch))
    with pytest.raises(AttributeError, match="has no attribute 'nothing'"):
        _ = tbatch.nothing
