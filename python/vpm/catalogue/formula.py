"""Laws that users write: expressions in q, v and parameters, compiled to a program that the core runs."""

import ast
import math
import operator
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from vpm.errors import ModelError

#: What the core has room for.
MOST_INSTRUCTIONS, MOST_WAITING, MOST_NUMBERS = 32, 8, 6
FUNCTIONS = ("abs", "sqrt", "exp", "tanh", "sin", "cos")
_OPERATIONS: Mapping[type[ast.operator], str] = {
    ast.Add: "add",
    ast.Sub: "subtract",
    ast.Mult: "multiply",
    ast.Div: "divide",
}

#: What the instructions on two numbers and on one compute.
_OF_TWO = {"add": operator.add, "subtract": operator.sub, "multiply": operator.mul, "divide": operator.truediv}
_OF_ONE: Mapping[str, Callable[[float], float]] = {
    "negate": operator.neg,
    "abs": abs,
    **{name: getattr(math, name) for name in FUNCTIONS if name != "abs"},
}

Instruction = str | dict[str, int]


@dataclass(frozen=True)
class Formula:
    """A law as text and as a program in postfix order."""

    text: str
    #: Instructions: ``"position"``, ``"velocity"``, ``{"parameter": k}``, ``{"constant": k}`` or an operation.
    program: tuple[Instruction, ...]
    constants: tuple[float, ...]

    def __call__(self, q: float, v: float, parameters: Sequence[float]) -> float:
        """Effort of a formula, as the core computes it.

        - ``q``, ``v``: coordinate and velocity of the joint (SI)
        - ``parameters``: in the order in which they were declared
        """
        stack: list[float] = []
        numbers = {"parameter": parameters, "constant": self.constants}
        for instruction in self.program:
            if isinstance(instruction, dict):
                ((kind, place),) = instruction.items()
                stack.append(stack.pop() ** place if kind == "power" else numbers[kind][place])
            elif instruction in _OF_TWO:
                second = stack.pop()
                stack.append(_OF_TWO[instruction](stack.pop(), second))
            elif instruction in _OF_ONE:
                stack.append(_OF_ONE[instruction](stack.pop()))
            else:
                stack.append(q if instruction == "position" else v)
        return stack[0]


def compile_formula(text: str, names: Sequence[str]) -> Formula:
    """Compile a user's formula into a postfix program.

    - ``text``: Python expression in ``q``, ``v``, ``pi``, numbers and parameters, with ``+ - * /``, whole powers, and
      the functions abs, sqrt, exp, tanh, sin and cos
    - ``names``: parameters, in the order of the core
    """
    if len(names) > MOST_NUMBERS:
        raise ModelError(f'the law "{text}" has {len(names)} parameters, but {MOST_NUMBERS} are the most; use fewer')
    try:
        tree = ast.parse(text, mode="eval").body
    except SyntaxError as error:
        raise ModelError(f'the law "{text}" is no expression ({error.msg}); write it as in Python') from None
    compiler = _Compiler(text, tuple(names))
    deepest = compiler.write(tree)
    for what, count, most in (
        ("operations and numbers", len(compiler.program), MOST_INSTRUCTIONS),
        ("constants", len(compiler.constants), MOST_NUMBERS),
        ("numbers that wait in brackets", deepest, MOST_WAITING),
    ):
        if count > most:
            raise ModelError(f'the law "{text}" has {count} {what}, but {most} are the most; write it shorter')
    return Formula(text, tuple(compiler.program), tuple(compiler.constants))


class _Compiler:
    """Writes the program of one expression."""

    def __init__(self, text: str, names: tuple[str, ...]) -> None:
        self.text, self.names = text, names
        self.program: list[Instruction] = []
        self.constants: list[float] = []

    def write(self, node: ast.expr) -> int:
        """Write the program of a formula's node; gives how many numbers wait at the most."""
        match node:
            case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
                return self._constant(float(value))
            case ast.Name(id=name):
                return self._named(name)
            case ast.UnaryOp(op=ast.USub(), operand=operand):
                return self._after(operand, "negate")
            case ast.BinOp(left=base, op=ast.Pow(), right=ast.Constant(value=int() as power)) if abs(power) < 100:
                return self._after(base, {"power": power})
            case ast.BinOp(left=left, op=operation, right=right) if type(operation) in _OPERATIONS:
                first, second = self.write(left), self.write(right)
                self.program.append(_OPERATIONS[type(operation)])
                return max(first, second + 1)
            case ast.Call(func=ast.Name(id=name), args=[argument], keywords=[]) if name in FUNCTIONS:
                return self._after(argument, name)
        raise ModelError(
            f'the law "{self.text}" has "{ast.unparse(node)}", which the core does not know; use + - * /, whole '
            f"powers, {', '.join(FUNCTIONS)} of q, v, pi and {', '.join(self.names)}"
        )

    def _after(self, operand: ast.expr, instruction: Instruction) -> int:
        deepest = self.write(operand)
        self.program.append(instruction)
        return deepest

    def _named(self, name: str) -> int:
        if name == "pi":
            return self._constant(math.pi)
        if name in {"q", "v"}:
            self.program.append("position" if name == "q" else "velocity")
        elif name in self.names:
            self.program.append({"parameter": self.names.index(name)})
        else:
            known = ", ".join(self.names)
            raise ModelError(f'the law "{self.text}" names {name}, which is no parameter; it has q, v, pi and {known}')
        return 1

    def _constant(self, value: float) -> int:
        if value not in self.constants:
            self.constants.append(value)
        self.program.append({"constant": self.constants.index(value)})
        return 1
