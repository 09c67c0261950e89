"""Reads YAML, and refuses duplicate keys. Needs no ROS."""

from __future__ import annotations

from typing import Any, Iterator, List, Type

import yaml

_MERGE = "tag:yaml.org,2002:merge"  # <<, which names another mapping; names may come again


class Texts(yaml.loader.BaseLoader):
    """Takes each scalar for a text, so that 1 and yes are names like any other."""


class ScalarValues(yaml.SafeLoader):
    """Takes scalars for numbers, truth values and texts."""


def load(text: str, loader: Type[Any] = ScalarValues) -> Any:
    """Parses a text.

    Args:
        text: YAML.
        loader: ``Texts`` or ``Values``.

    Raises:
        yaml.YAMLError: The text is no YAML, is nested too deeply, or has a name twice, of which
            the library would keep the last; the message says where.
    """
    try:
        return yaml.load(text, loader)  # noqa: S506 (both loaders are safe)
    except RecursionError as err:
        raise yaml.YAMLError("it is nested too deeply") from err


def _mapping(loader: Any, node: yaml.MappingNode) -> Iterator[Any]:
    """Makes a mapping of a node; PyYAML fills it later, so that it may hold itself."""
    keys: List[Any] = []
    for key_node, _ in node.value:
        if key_node.tag == _MERGE:
            continue
        key = loader.construct_object(key_node, deep=True)
        if key in keys:
            line = key_node.start_mark.line + 1
            raise yaml.YAMLError(f"line {line}: {key} is there twice; remove or rename one")
        keys.append(key)
    yield from yaml.constructor.SafeConstructor.construct_yaml_map(loader, node)


for _loader in (Texts, ScalarValues):
    _loader.add_constructor("tag:yaml.org,2002:map", _mapping)
