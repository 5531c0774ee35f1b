"""Sweep files as YAML: plain values by the core schema of YAML 1.2.2 (section 10.3), and nothing else.

PyYAML follows YAML 1.1, in which 1:30 is 90, 010 is 8, 1e-3 is text, and many words are booleans (yes, no, on, off) or
dates. Here they read as in JSON.
"""

from __future__ import annotations

import collections
import re
from typing import Any

from artde_gym.extras import needs

with needs("sweep"):
    import yaml

_TAG = "tag:yaml.org,2002:"
_CORE = {
    "null": r"~|null|Null|NULL|",
    "bool": r"true|True|TRUE|false|False|FALSE",
    "int": r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+",
    "float": r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?|[-+]?\.(inf|Inf|INF)|\.(nan|NaN|NAN)",
}


class Loader(yaml.SafeLoader):
    """A safe loader that rejects aliases (they can make a small file large) and duplicate keys (they lose values)."""

    def compose_node(self, parent: Any, index: Any) -> Any:
        if self.check_event(yaml.AliasEvent):
            raise yaml.YAMLError("an alias (*name), not allowed in sweep files")
        return super().compose_node(parent, index)

    def construct_mapping(self, node: Any, deep: bool = False) -> Any:
        keys = [(key.tag, key.value) for key, _ in node.value if isinstance(key, yaml.ScalarNode)]
        for (_, key), count in collections.Counter(keys).items():
            if count > 1:
                raise yaml.YAMLError(f"the key {key!r} is given {count} times")
        return super().construct_mapping(node, deep)


def _whole(loader: Any, node: Any) -> int:
    text = loader.construct_scalar(node)
    return int(text, 0) if text.startswith(("0o", "0x")) else int(text)


def _real(loader: Any, node: Any) -> float:
    text = loader.construct_scalar(node).lower()
    return float(text.replace(".inf", "inf").replace(".nan", "nan"))


Loader.yaml_implicit_resolvers = {None: [(_TAG + name, re.compile(rf"(?:{text})\Z")) for name, text in _CORE.items()]}
Loader.add_constructor(_TAG + "int", _whole)
Loader.add_constructor(_TAG + "float", _real)
