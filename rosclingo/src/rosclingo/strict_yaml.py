r"""Parser for untrusted YAML: whatever is wrong with a text is one kind of error.

PyYAML alone lets other errors pass, such as that of ``!!int x``, keeps the last of two values with
the same name, and makes of a short text with aliases a value that fills the memory when it is
printed. Needs no ROS.

>>> load("{a: 1, b: [x, yes]}")
{'a': 1, 'b': ['x', True]}
>>> load("a: 1\na: 2")
Traceback (most recent call last):
    ...
rosclingo.strict_yaml.StrictYamlError: line 2: a is there twice; remove or rename one
"""

from __future__ import annotations

import contextlib
from typing import Any, Dict, Iterator, List, Tuple, Type

import yaml

from rosclingo.errors import shorten

_MERGE = "tag:yaml.org,2002:merge"  # <<, which names another mapping; names may come again
_MOST = 200_000  # values, those of aliases each time
_DEEPEST = 50  # levels of lists and mappings
_TOO_DEEP = f"it is nested too deeply, in {_DEEPEST} levels"
_LARGEST = 2**63  # no integer that anybody means
# All that PyYAML's constructors raise at a text that does not fit its tag.
_MISFITS = (ValueError, OverflowError, LookupError, AttributeError, TypeError)


class StrictYamlError(yaml.MarkedYAMLError):
    """An error that PyYAML would not tell, or not in this way; the text begins with the line."""

    def __str__(self) -> str:
        return f"line {self.problem_mark.line + 1}: {self.problem}"


class _BoundedDepth:
    """Refuses deep nesting while it is read, as PyYAML's time grows with the square of it."""

    def fetch_flow_collection_start(self: Any, token: Any) -> None:
        """Begins a list or a mapping in brackets."""
        self._check_depth(self.flow_level)
        super().fetch_flow_collection_start(token)  # type: ignore[misc]  # of PyYAML's scanner

    def add_indent(self: Any, column: int) -> bool:
        """Begins a list or a mapping by its indentation."""
        self._check_depth(len(self.indents))
        return bool(super().add_indent(column))  # type: ignore[misc]  # of PyYAML's scanner

    def _check_depth(self: Any, depth: int) -> None:
        if depth >= _DEEPEST:
            raise StrictYamlError(problem=_TOO_DEEP, problem_mark=self.get_mark())


class Texts(_BoundedDepth, yaml.loader.BaseLoader):
    """Takes each scalar for a text, so that 1 and yes are names like any other."""


class ScalarValues(_BoundedDepth, yaml.SafeLoader):
    """Takes scalars for numbers, truth values and texts."""

    def construct_object(self, node: Any, deep: bool = False) -> Any:
        """Makes a value of a node.

        Raises:
            yaml.YAMLError: Its text does not fit its tag.
        """
        try:
            value = super().construct_object(node, deep=deep)
        except _MISFITS as err:
            text = shorten(str(node.value), 80) if isinstance(node, yaml.ScalarNode) else "this"
            raise _wrong(node, f"{text} is no {node.tag.split(':')[-1]}; correct it") from err
        if isinstance(value, int) and abs(value) >= _LARGEST:
            raise _wrong(node, f"{shorten(str(node.value), 80)} is too large a number")
        return value


def load(text: str, loader: Type[Any] = ScalarValues) -> Any:
    """Parses a text.

    Args:
        text: YAML.
        loader: ``Texts`` or ``ScalarValues``.

    Raises:
        yaml.YAMLError: The text is no YAML, is nested too deeply, has a number that is too large,
            too many values, or a name twice; the message says where.
    """
    with _reader(text, loader) as reader:
        node = _compose(reader)
        return None if node is None else reader.construct_document(node)


def compose(text: str, loader: Type[Any] = ScalarValues) -> Any:
    """Parses a text to PyYAML's nodes, which know their lines; None if it is empty.

    Raises:
        yaml.YAMLError: As in :func:`load`, but for what values and names say.
    """
    with _reader(text, loader) as reader:
        return _compose(reader)


@contextlib.contextmanager
def _reader(text: str, loader: Type[Any]) -> Iterator[Any]:
    """A loader of a text, whose messages are shortened, as they quote all of a long name."""
    try:
        made = loader(text)
        try:
            yield made
        except (ValueError, OverflowError) as err:  # of escapes and versions with many digits
            problem = f"{shorten(str(err))}; correct it"
            raise StrictYamlError(problem=problem, problem_mark=made.get_mark()) from err
        finally:
            made.dispose()
    except StrictYamlError:
        raise
    except yaml.MarkedYAMLError as err:
        mark = err.problem_mark or err.context_mark
        raise StrictYamlError(problem=shorten(str(err.problem)), problem_mark=mark) from err


def _compose(loader: Any) -> Any:
    node = loader.get_single_node()
    if node is not None:
        _measure(node, {}, [])
    return node


def _measure(
    node: yaml.Node, known: Dict[int, Tuple[int, int]], around: List[int]
) -> Tuple[int, int]:
    """Returns how many values a node has, and in how many levels, those of aliases each time."""
    key = id(node)
    if key in around:
        raise _wrong(node, "it holds itself by an alias; write it without")
    if key not in known:
        total, levels = 1, 0
        if not isinstance(node, yaml.ScalarNode):
            around.append(key)
            for part in node.value:
                for one in part if isinstance(part, tuple) else (part,):
                    more, below = _measure(one, known, around)
                    total, levels = total + more, max(levels, below)
            levels += 1
            around.pop()
        if total > _MOST:
            raise _wrong(node, f"aliases make more than {_MOST} values of it; write fewer")
        if levels > _DEEPEST:
            raise _wrong(node, f"{_TOO_DEEP}, with its aliases")
        known[key] = total, levels
    return known[key]


def _mapping(loader: Any, node: yaml.MappingNode) -> Iterator[Any]:
    """Makes a mapping of a node; PyYAML fills it later, so that it may hold itself."""
    keys: Dict[Any, bool] = {}
    for key_node, _ in node.value:
        if key_node.tag == _MERGE:
            continue
        key = loader.construct_object(key_node, deep=True)
        try:
            is_known = keys.setdefault(key, False)
        except TypeError as err:
            raise _wrong(key_node, "expected a name, and no list or mapping") from err
        if is_known:
            text = shorten(str(key), 80)
            raise _wrong(key_node, f"{text} is there twice; remove or rename one")
        keys[key] = True
    yield from yaml.constructor.SafeConstructor.construct_yaml_map(loader, node)


def _wrong(node: yaml.Node, reason: str) -> StrictYamlError:
    return StrictYamlError(problem=reason, problem_mark=node.start_mark)


for _loader in (Texts, ScalarValues):
    _loader.add_constructor("tag:yaml.org,2002:map", _mapping)
