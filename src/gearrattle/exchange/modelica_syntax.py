"""Reading of Modelica text: tokens, declarations, equations, constant expressions; each with its line.

Only the structure of one class is read (Modelica Language Specification 3.6, Appendix A): nested classes are kept as
their tokens, and what is no declaration and no connection is kept for the report of what was not understood.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import NamedTuple

from gearrattle.errors import ModelError, Problem

Value = float | bool | str | list["Value"]
_TOKEN = re.compile(
    r"""(?P<space>\s+|//[^\n]*|/\*.*?\*/)
    |(?P<number>(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?)
    |(?P<name>[A-Za-z_]\w*|'(?:[^'\\]|\\.)*')
    |(?P<string>"(?:[^"\\]|\\.)*")
    |(?P<sign><=|>=|<>|==|:=|\.\*|\.\+|\.-|\./|\.\^|[-+*/^()\[\]{},;:=<>.])""",
    re.VERBOSE | re.DOTALL,
)
_MOST_TOKENS = 400_000
_DEEPEST = 60
_OPENING = frozenset("([{")
_CLOSING = frozenset(")]}")
_SECTIONS = frozenset({"public", "protected", "equation", "algorithm", "initial"})
_PREFIXES = frozenset(
    {"final", "inner", "outer", "flow", "stream", "discrete", "parameter", "constant"}
    | {"input", "output", "replaceable", "redeclare"}
)
_CLASSES = frozenset(["model", "class", "block", "package", "record", "connector", "function", "type", "operator"])
_FUNCTIONS: Mapping[str, Callable[[float], float]] = {
    "sqrt": math.sqrt,
    "sin": math.sin,
    "cos": math.cos,
    "tan": math.tan,
    "exp": math.exp,
    "log": math.log,
    "abs": abs,
    "from_rpm": lambda rpm: rpm * 2.0 * math.pi / 60.0,
    "from_deg": math.radians,
}
_CONVERSIONS = ("Modelica.Units.Conversions.", "Modelica.SIunits.Conversions.")
_PI = ("pi", "Constants.pi", "Modelica.Constants.pi")


class Token(NamedTuple):
    """A word of the text, its kind and line."""

    kind: str
    text: str
    line: int


class NotConstant(Exception):
    """An expression that is no constant of the text; carries the reason."""


@dataclass(frozen=True)
class Declaration:
    """A component or a parameter of a class.

    Attributes
    ----------
    type
        name of its type as written.
    name
        its own.
    line
        where.
    modifiers
        tokens of the value of every modifier, by name; nested ones as "phi.start".
    value
        tokens after "=".
    prefixes
        parameter, constant and so on.
    annotation
        tokens of its annotation.
    """

    type: str
    name: str
    line: int
    modifiers: Mapping[str, list[Token]]
    value: list[Token]
    prefixes: frozenset[str]
    annotation: list[Token] = field(default_factory=list)


@dataclass
class ModelicaClass:
    """What a class holds.

    Attributes
    ----------
    name, within
        its own, and that of the package it is in.
    imports
        full name by short name; "" with a package for all its names.
    declarations
        in their order.
    connections
        pairs of connectors with their line.
    classes
        tokens of nested classes by name.
    annotation
        tokens of its annotation.
    others
        statements of no known kind: line and text.
    """

    name: str = ""
    within: str = ""
    imports: dict[str, str] = field(default_factory=dict)
    declarations: list[Declaration] = field(default_factory=list)
    connections: list[tuple[str, str, int]] = field(default_factory=list)
    classes: dict[str, list[Token]] = field(default_factory=dict)
    annotation: list[Token] = field(default_factory=list)
    others: list[tuple[int, str]] = field(default_factory=list)


def tokens_of(text: str) -> list[Token]:
    """Return the tokens of a text; ModelError for a character that begins none, and for very long texts."""
    tokens = []
    position = 0
    line = 1
    while position < len(text):
        match = _TOKEN.match(text, position)
        if match is None:
            raise ModelError(Problem(f"line {line}", repr(text[position]), "begins no word of Modelica"))
        if match.lastgroup != "space":
            tokens.append(Token(str(match.lastgroup), match[0], line))
        line += match[0].count("\n")
        position = match.end()
        if len(tokens) > _MOST_TOKENS:
            raise ModelError(Problem(f"line {line}", "", f"the text has more than {_MOST_TOKENS} words"))
    return tokens


def class_of(text: str) -> ModelicaClass:
    """Return the first class of a text; ModelError if there is none, or if it does not end."""
    tokens = tokens_of(text)
    made = ModelicaClass()
    index = 0
    if tokens and tokens[0].text == "within":
        end = _statement_end(tokens, 0)
        made.within = "".join(token.text for token in tokens[1:end])
        index = end + 1
    while index < len(tokens) and tokens[index].text in ("partial", "encapsulated", "final"):
        index += 1
    if index + 1 >= len(tokens) or tokens[index].text not in ("model", "class", "block"):
        line = tokens[index].line if index < len(tokens) else 1
        raise ModelError(Problem(f"line {line}", "", "a Modelica text must begin with a model"))
    made.name = tokens[index + 1].text
    end = _class_end(tokens, index)
    _read_class(made, tokens[index + 2 : end])
    if end + 3 < len(tokens):
        words = " ".join(token.text for token in tokens[end + 3 : end + 6])
        made.others.append((tokens[end + 3].line, f"{words} ...: text after the first model"))
    return made


def _class_end(tokens: list[Token], index: int) -> int:
    """Index of the "end" that closes the class whose keyword is at ``index``."""
    name = tokens[index + 1].text
    for k in range(index + 2, len(tokens) - 1):
        if tokens[k].text == "end" and tokens[k + 1].text == name:
            return k
    raise ModelError(Problem(f"line {tokens[index].line}", name, f'must close with "end {name};"'))


def _statement_end(tokens: list[Token], index: int) -> int:
    """Index of the semicolon that ends a statement."""
    depth = 0
    for k in range(index, len(tokens)):
        text = tokens[k].text
        if text in _OPENING and tokens[k].kind == "sign":
            depth += 1
            if depth > _DEEPEST:
                raise ModelError(Problem(f"line {tokens[k].line}", "", "brackets are nested too deeply"))
        elif text in _CLOSING and tokens[k].kind == "sign":
            depth -= 1
        elif text == ";" and depth <= 0:
            return k
    raise ModelError(Problem(f"line {tokens[index].line}", tokens[index].text, "a statement must end with a semicolon"))


def _read_class(made: ModelicaClass, tokens: list[Token]) -> None:
    """Read the body of a class."""
    section = "public"
    index = 1 if tokens and tokens[0].kind == "string" else 0
    while index < len(tokens):
        word = tokens[index].text
        if word in _SECTIONS:
            section = word if word != "initial" else "initial equation"
            index += 1 + (word == "initial")
            continue
        keyword = index + (word in ("partial", "encapsulated", "replaceable", "final"))
        if section in ("public", "protected") and keyword < len(tokens) and tokens[keyword].text in _CLASSES:
            end = _class_end(tokens, keyword)
            made.classes[tokens[keyword + 1].text] = tokens[keyword : end + 2]
            index = end + 3
            continue
        end = _statement_end(tokens, index)
        statement = tokens[index:end]
        index = end + 1
        if statement:
            _read_statement(made, statement, section)


def _read_statement(made: ModelicaClass, statement: list[Token], section: str) -> None:
    word = statement[0].text
    line = statement[0].line
    if word == "annotation":
        made.annotation = statement
    elif word == "import":
        _read_import(made, statement[1:])
    elif section == "equation" and word == "connect":
        ends = _split(_inside(statement[1:]), ",")
        if len(ends) != 2:
            raise ModelError(Problem(f"line {line}", "connect", "must join two connectors"))
        made.connections.append((_joined(ends[0]), _joined(ends[1]), line))
    elif section in ("public", "protected") and word not in ("extends", "constrainedby"):
        made.declarations += _declarations(statement)
    else:
        made.others.append((line, " ".join(token.text for token in statement)[:80]))


def _read_import(made: ModelicaClass, tokens: list[Token]) -> None:
    """Read ``import A.B.C``, ``import X = A.B``, ``import A.B.*`` or ``import A.{X, Y}``."""
    text = _joined([token for token in tokens if token.kind != "string"])
    short, is_renamed, path = text.partition("=")
    if is_renamed:
        made.imports[short] = path
    elif text.endswith(".*"):
        made.imports.setdefault(f"*{len(made.imports)}", text[:-2])
    elif text.endswith("}"):
        package, _, names = text[:-1].partition(".{")
        made.imports |= {name: f"{package}.{name}" for name in names.split(",")}
    else:
        made.imports[text.rpartition(".")[2]] = text


def _joined(tokens: list[Token]) -> str:
    return "".join(token.text for token in tokens)


def _inside(tokens: list[Token]) -> list[Token]:
    """Tokens inside the bracket with which the tokens begin."""
    return tokens[1 : _bracket_end(tokens, 0)]


def _bracket_end(tokens: list[Token], index: int) -> int:
    """Index of the bracket that closes the one at ``index``."""
    depth = 0
    for k in range(index, len(tokens)):
        if tokens[k].kind == "sign":
            depth += (tokens[k].text in _OPENING) - (tokens[k].text in _CLOSING)
            if depth == 0:
                return k
    raise ModelError(Problem(f"line {tokens[index].line}", tokens[index].text, "a bracket must be closed"))


def _split(tokens: list[Token], separator: str) -> list[list[Token]]:
    """Tokens between separators outside of brackets."""
    parts: list[list[Token]] = [[]]
    depth = 0
    for token in tokens:
        if token.kind == "sign":
            depth += (token.text in _OPENING) - (token.text in _CLOSING)
        if token.text == separator and depth == 0:
            parts.append([])
        else:
            parts[-1].append(token)
    return parts


def _declarations(statement: list[Token]) -> list[Declaration]:
    """The declarations of a statement ``prefixes type name(modifiers) = value "comment" annotation(...), ...``."""
    prefixes = set[str]()
    index = 0
    while index < len(statement) and statement[index].text in _PREFIXES:
        prefixes.add(statement[index].text)
        index += 1
    begin = index
    while index < len(statement) and (statement[index].kind == "name" or statement[index].text == "."):
        index += 1
        if index < len(statement) and statement[index].kind == "name" and statement[index - 1].text != ".":
            break
    type_name = _joined(statement[begin:index])
    if index < len(statement) and statement[index].text == "[":
        index = _bracket_end(statement, index) + 1
    made = []
    for part in _split(statement[index:], ","):
        if not part or part[0].kind != "name":
            where = f"line {statement[0].line}"
            raise ModelError(Problem(where, " ".join(t.text for t in statement)[:60], "is no declaration of Modelica"))
        made.append(_declaration(type_name, part, frozenset(prefixes)))
    return made


def _declaration(type_name: str, part: list[Token], prefixes: frozenset[str]) -> Declaration:
    index = 1
    modifiers: dict[str, list[Token]] = {}
    value = list[Token]()
    annotation = list[Token]()
    if index < len(part) and part[index].text == "[":
        index = _bracket_end(part, index) + 1
        modifiers["[]"] = part[1:index]
    if index < len(part) and part[index].text == "(":
        end = _bracket_end(part, index)
        modifiers |= modifiers_of(part[index + 1 : end])
        index = end + 1
    if index < len(part) and part[index].text == "=":
        end = index + 1
        while end < len(part) and part[end].kind != "string" and part[end].text not in ("annotation", "if"):
            end += 1
        value = part[index + 1 : end]
        index = end
    for k in range(index, len(part)):
        if part[k].text == "annotation":
            annotation = part[k:]
        elif part[k].text == "if":
            modifiers["if"] = part[k + 1 :]
    return Declaration(type_name, part[0].text, part[0].line, modifiers, value, prefixes, annotation)


def modifiers_of(tokens: list[Token], before: str = "") -> dict[str, list[Token]]:
    """Return the tokens of the values of modifiers ``a = 1, phi(start = 2)`` by name, "a" and "phi.start"."""
    made: dict[str, list[Token]] = {}
    for part in _split(tokens, ","):
        words = [token for token in part if token.text not in ("final", "each", "redeclare")]
        equal = next((k for k, token in enumerate(words) if token.text in ("=", "(")), len(words))
        name = before + _joined(words[:equal])
        if equal < len(words) and words[equal].text == "(":
            end = _bracket_end(words, equal)
            if before.count(".") > 5:
                raise ModelError(Problem(f"line {words[0].line}", name, "modifiers are nested too deeply"))
            made |= modifiers_of(words[equal + 1 : end], f"{name}.")
            words = words[end:]
            equal = 1
        if words[equal + 1 :]:
            made[name] = words[equal + 1 :]
    return made


class Constants:
    """Values of the constant expressions of a class."""

    def __init__(self, made: ModelicaClass) -> None:
        self._expressions = {
            one.name: one.value for one in made.declarations if {"parameter", "constant"} & one.prefixes
        }
        self._known: dict[str, Value] = {}
        self._open = set[str]()

    def value(self, tokens: list[Token]) -> Value:
        """Return the value of an expression; NotConstant with the reason."""
        if not tokens:
            raise NotConstant("has no value")
        reader = _Reader(tokens, self)
        value = reader.sum()
        if reader.index < len(tokens):
            raise NotConstant(f'"{tokens[reader.index].text}" is no part of a constant expression')
        return value

    def number(self, tokens: list[Token]) -> float:
        """Return the value of an expression that is a finite number; NotConstant with the reason."""
        value = self.value(tokens)
        if isinstance(value, bool) or not isinstance(value, float) or not math.isfinite(value):
            raise NotConstant("is no number")
        return value

    def of_name(self, name: str) -> Value:
        """Return the value of a parameter."""
        if name in _PI:
            return math.pi
        if name not in self._expressions:
            raise NotConstant(f'"{name}" is no parameter with a value')
        if name not in self._known:
            if name in self._open:
                raise NotConstant(f'"{name}" depends on itself')
            if len(self._open) > _DEEPEST:
                raise NotConstant("parameters depend on each other through too many steps")
            self._open.add(name)
            try:
                self._known[name] = self.value(self._expressions[name])
            finally:
                self._open.discard(name)
        return self._known[name]


class _Reader:
    """Evaluates an expression from left to right."""

    def __init__(self, tokens: list[Token], constants: Constants) -> None:
        self.tokens = tokens
        self.index = 0
        self._constants = constants
        self._depth = 0

    def _next(self, *texts: str) -> str:
        """Pass over the next token if it is one of these, and return it; else empty."""
        if self.index < len(self.tokens) and self.tokens[self.index].text in texts:
            self.index += 1
            return self.tokens[self.index - 1].text
        return ""

    def sum(self) -> Value:
        """Terms with signs."""
        self._depth += 1
        if self._depth > _DEEPEST:
            raise NotConstant("is nested too deeply")
        sign = self._next("+", "-")
        value = self._product()
        if sign == "-":
            value = -_number(value)
        while operator := self._next("+", "-"):
            other = _number(self._product())
            value = _number(value) + other if operator == "+" else _number(value) - other
        self._depth -= 1
        return value

    def _product(self) -> Value:
        value = self._power()
        while operator := self._next("*", "/"):
            other = _number(self._power())
            if operator == "/" and other == 0.0:
                raise NotConstant("divides by zero")
            value = _number(value) * other if operator == "*" else _number(value) / other
        return value

    def _power(self) -> Value:
        value = self._primary()
        if self._next("^"):
            sign = -1.0 if self._next("-") else 1.0
            exponent = sign * _number(self._primary())
            try:
                raised = _number(value) ** exponent
            except (OverflowError, ZeroDivisionError):
                raise NotConstant("has a power that is no number") from None
            if isinstance(raised, complex):
                raise NotConstant("has a power that is no real number")
            return float(raised)
        return value

    def _primary(self) -> Value:
        if self.index >= len(self.tokens):
            raise NotConstant("ends too early")
        token = self.tokens[self.index]
        self.index += 1
        if token.kind == "number":
            return float(token.text)
        if token.kind == "string":
            return token.text[1:-1]
        if token.text == "(":
            value = self.sum()
            if not self._next(")"):
                raise NotConstant("has an open bracket")
            return value
        if token.text == "{":
            values = [self.sum()]
            while self._next(","):
                values.append(self.sum())
            if not self._next("}"):
                raise NotConstant("has an open bracket")
            return values
        if token.text in ("true", "false"):
            return token.text == "true"
        if token.kind == "name":
            return self._named(token.text)
        raise NotConstant(f'"{token.text}" is no part of a constant expression')

    def _named(self, name: str) -> Value:
        while self._next("."):
            if self.index >= len(self.tokens):
                raise NotConstant("ends too early")
            name += "." + self.tokens[self.index].text
            self.index += 1
        if self._next("("):
            argument = _number(self.sum())
            if not self._next(")"):
                raise NotConstant(f'"{name}" takes one argument here')
            short = next((name.removeprefix(prefix) for prefix in _CONVERSIONS if name.startswith(prefix)), name)
            if short not in _FUNCTIONS:
                raise NotConstant(f'the function "{name}" is not known')
            try:
                return float(_FUNCTIONS[short](argument))
            except (ValueError, OverflowError):
                raise NotConstant(f'"{name}" has no value there') from None
        return self._constants.of_name(name)


def _number(value: Value) -> float:
    if isinstance(value, bool) or not isinstance(value, float):
        raise NotConstant("calculates with what is no number")
    return value
