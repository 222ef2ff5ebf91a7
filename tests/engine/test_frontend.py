"""The front end that reads each function once compiles what Taichi's own does, and says where a mistake stands."""

import importlib.util

import pytest

from tbatch.engine import runtime

MISTAKE = """import taichi as ti


@ti.func
def twice(x):
    return 2.0 * x + unheard_of


@ti.kernel
def wrong() -> ti.f64:
    return twice(1.0)
"""

METHOD = """import taichi as ti


@ti.func
def doubled(x):
    return 2.0 * x


@ti.data_oriented
class Counter:
    def __init__(self, step):
        self.step = step

    @ti.func
    def next(self, x):
        return x + self.step

    @ti.kernel
    def count(self, x: ti.f64) -> ti.f64:
        return doubled(self.next(doubled(x))) + doubled(x)

    @ti.kernel
    def kinds(self, kind: ti.template(), x: ti.f64) -> ti.f64:
        return doubled(x) if ti.static(kind) else self.next(x)
"""


def loaded(tmp_path, text):
    """A module of kernels from a file, which Taichi reads."""
    runtime.start(1)
    path = tmp_path / f"kernels_{abs(hash(text))}.py"
    path.write_text(text)
    spec = importlib.util.spec_from_file_location(path.stem, path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return path, module


def test_a_mistake_in_an_inlined_function_is_shown_with_file_line_and_text(tmp_path):
    path, module = loaded(tmp_path, MISTAKE)
    with pytest.raises(Exception, match="unheard_of") as caught:
        module.wrong()
    assert f'File "{path}", line 6, in twice:\nreturn 2.0 * x + unheard_of' in str(caught.value)


def test_functions_are_inlined_again_and_again_and_kernels_compiled_for_each_template_argument(tmp_path):
    _, module = loaded(tmp_path, METHOD)
    counter = module.Counter(0.5)
    assert counter.count(3.0) == 2.0 * (2.0 * 3.0 + 0.5) + 2.0 * 3.0
    assert [counter.kinds(True, 3.0), counter.kinds(False, 3.0), counter.kinds(True, 4.0)] == [6.0, 3.5, 8.0]


def test_a_class_body_is_told_from_a_module_and_a_function():
    from tbatch.engine.frontend import _inside_class

    def decorate(function):
        return _inside_class(2 + 1)

    class Body:
        @decorate
        def method(self):
            """In a class."""

    @decorate
    def function():
        """In a function."""

    assert Body.__dict__["method"] is True
    assert function is False
