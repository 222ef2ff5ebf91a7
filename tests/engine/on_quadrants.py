"""Runs the digests of `bits` with the fork Quadrants in Taichi's place: `python on_quadrants.py COUNT`."""

import dataclasses
import importlib
import importlib.abc
import importlib.util
import sys
import types
from typing import Any


class InPlaceOfTaichi(importlib.abc.MetaPathFinder, importlib.abc.Loader):
    """Gives quadrants, and its modules, where taichi is asked for."""

    def find_spec(self, name: str, path: Any, target: Any = None) -> Any:
        """Whatever is Taichi's."""
        return importlib.util.spec_from_loader(name, self) if name.partition(".")[0] == "taichi" else None

    def create_module(self, spec: Any) -> types.ModuleType:
        """The module of the same place in quadrants."""
        return importlib.import_module("quadrants" + spec.name.removeprefix("taichi"))

    def exec_module(self, module: types.ModuleType) -> None:
        """Nothing is left to do."""


class Plain:
    """A template argument: Quadrants 1.3.3 takes a dataclass apart into its fields, a plain object as one."""

    @classmethod
    def of(cls, value: Any) -> Any:
        """The same names and values in a plain object, dataclasses within it too."""
        if isinstance(value, tuple):
            return tuple(cls.of(item) for item in value)
        if not dataclasses.is_dataclass(value):
            return value
        plain = cls()
        for name in dir(value):
            if not name.startswith("_"):
                setattr(plain, name, cls.of(getattr(value, name)))
        return plain


if __name__ == "__main__":
    sys.meta_path.insert(0, InPlaceOfTaichi())
    # What hastens Taichi's front end would have nothing to hold on to.
    frontend: Any = types.ModuleType("tbatch.engine.frontend")
    frontend.read_functions_once = lambda: None
    sys.modules["tbatch.engine.frontend"] = frontend

    from bits import digests, simulated

    from tbatch.engine.simulate import _Launch

    bind = _Launch.__init__

    def bind_plain(launch: Any, *given: Any) -> None:
        """Bind the kernel to plain template arguments."""
        bind(launch, *given)
        launch._compiled_in = Plain.of(launch._compiled_in)

    _Launch.__init__ = bind_plain
    print(*digests(simulated(range(int(sys.argv[1])))), sep="\n")
