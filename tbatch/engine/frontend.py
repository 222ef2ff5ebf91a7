"""Makes Taichi's Python front end read each kernel function once.

The compiler of Taichi 1.7.4 reads, parses and wraps the text of a function anew at every inlined call, and words the
place of every syntax node for error messages that only a change of the kernels could bring up. Together that is half of
a start from the kernel cache. The compiled code and the keys of the cache stay as they are.
"""

import ast
import sys
import textwrap
from typing import Any

_Source = tuple[str, list[str], int, ast.Module]


def read_functions_once() -> None:
    """Replace the slow steps of the front end; before the kernels are imported."""
    from taichi.lang import kernel_impl
    from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext

    sources: dict[Any, _Source] = {}

    def tree_and_context(
        function: Any,
        excluded_parameters: Any = (),
        is_kernel: bool = True,
        arg_features: Any = None,
        args: Any = None,
        ast_builder: Any = None,
        is_real_function: bool = False,
    ) -> tuple[ast.Module, Any]:
        if is_kernel or function.func not in sources:  # the transformer strips a kernel's tree of its arguments
            sources[function.func] = _source(kernel_impl, function.func)
        file, lines, first, tree = sources[function.func]
        names = kernel_impl._get_global_vars(function.func)
        if is_kernel or is_real_function:
            names |= {function.arguments[i].name: args[i] for i in function.template_slot_locations}
        return tree, ASTTransformerContext(
            excluded_parameters=excluded_parameters,
            is_kernel=is_kernel,
            func=function,
            arg_features=arg_features,
            global_vars=names,
            argument_data=args,
            src=lines,
            start_lineno=first,
            file=file,
            ast_builder=ast_builder,
            is_real_function=is_real_function,
        )

    kernel_impl._get_tree_and_ctx = tree_and_context
    kernel_impl._inside_class = _inside_class
    ASTTransformerContext.get_pos_info = _place


def _source(kernel_impl: Any, function: Any) -> _Source:
    """File, lines, first line number and syntax tree of a function."""
    lines, first = kernel_impl.getsourcelines(function)
    lines = [line.rstrip("\n").expandtabs(4) for line in lines]
    tree = ast.parse(textwrap.dedent("\n".join(lines)))
    definition = tree.body[0]
    assert isinstance(definition, ast.FunctionDef)
    definition.decorator_list = []
    return kernel_impl.getsourcefile(function), lines, first, tree


def _inside_class(level_of_class_stackframe: int) -> bool:
    """Whether a function is decorated in the body of a class; the level is that of the frame around that body."""
    return "__qualname__" in sys._getframe(level_of_class_stackframe - 1).f_locals


def _place(context: Any, node: Any) -> str:
    """Where a syntax node stands, for messages."""
    line = context.src[node.lineno - 1].strip()
    return (
        f'File "{context.file}", line {node.lineno + context.lineno_offset}, in {context.func.func.__name__}:\n{line}\n'
    )
