"""Settings of the stages and limits of input files."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any, Final

from . import _native as _rust
from ._errors import SettingsError
from ._frozen import Frozen

#: Sections that change results; the others belong to a project.
_SECTIONS: Final = ("pipeline", "fit", "depth", "normalize", "register", "limits")


class Settings(Frozen):
    """Settings of the stages and limits of input files. Made by `settings`.

    Attributes
    ----------
    preset : str
        ``"default"`` or ``"paper"``.
    changes : tuple of (str, object)
        Names and values of the settings that differ from the preset.
    """

    __slots__ = ("preset", "changes", "_native")
    preset: str
    changes: tuple[tuple[str, Any], ...]
    _native: _rust.NativeSettings

    def __init__(self, preset: str = "default", changes: tuple[tuple[str, Any], ...] = ()) -> None:
        sets = [f"{name}={_toml(name, value)}" for name, value in changes]
        self._set(preset=preset, changes=changes, _native=_rust.NativeSettings(preset, sets))

    def to_dict(self) -> dict[str, Any]:
        """Return all settings by section.

        Examples
        --------
        >>> import mocban
        >>> mocban.settings().to_dict()["depth"]["longest_px"]
        512
        """
        values = json.loads(self._native.json)
        return {section: values[section] for section in _SECTIONS if section in values}

    def __getitem__(self, name: str) -> Any:
        value: Any = self.to_dict()
        try:
            for part in name.split("."):
                value = value[part]
        except (KeyError, TypeError):
            raise KeyError(name) from None
        return value

    def __contains__(self, name: object) -> bool:
        try:
            self[str(name)]
        except KeyError:
            return False
        return True

    def __iter__(self) -> Iterator[str]:
        return iter(self.to_dict())

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Settings) and self._native.json == other._native.json

    def __hash__(self) -> int:
        return hash(self._native.json)

    def __reduce__(self) -> tuple[Any, ...]:
        return Settings, (self.preset, self.changes)

    def __repr__(self) -> str:
        changes = "".join(f", {name.replace('.', '__')}={value!r}" for name, value in self.changes)
        return f"mocban.settings({self.preset!r}{changes})"


def _toml(name: str, value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, (int, float, str)):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(_toml(name, item) for item in value) + "]"
    if hasattr(value, "item"):
        return _toml(name, value.item())
    raise SettingsError(f"{name} = {value!r}: give a number, a string, a boolean or a list", "settings")


def settings(preset: str = "default", **changes: Any) -> Settings:
    """Return a preset with changes.

    The project's file and environment variables are not read.

    Parameters
    ----------
    preset : {"default", "paper"}
        The recommended method, or that of the paper (arXiv 2411.05524).
    **changes
        Settings as ``section__key=value``, or sections as ``section={"key": value}``.

    Returns
    -------
    Settings

    Raises
    ------
    SettingsError
        If a setting does not exist, or a value has the wrong type or lies outside its range.

    Examples
    --------
    >>> import mocban
    >>> mocban.settings(depth__longest_px=256)
    mocban.settings('default', depth__longest_px=256)
    >>> mocban.settings(depth={"longest_px": 256})["depth.longest_px"]
    256
    """
    flat: list[tuple[str, Any]] = []
    for key, value in changes.items():
        name = key.replace("__", ".")
        if isinstance(value, Mapping):
            flat.extend((f"{name}.{inner}", part) for inner, part in value.items())
        else:
            flat.append((name, value))
    for place, (name, _) in enumerate(flat):
        if any(name == other for other, _ in flat[:place]):
            raise SettingsError(f"{name} is given twice", "settings")
        section = name.partition(".")[0]
        if section in ("run", "storage", "review"):
            text = f"{name} belongs to a project and not to an alignment; set it in the project's mocban.toml"
            raise SettingsError(text, "settings")
        if "." not in name:
            text = f"{name} is not of the form section__key, such as depth__longest_px"
            raise SettingsError(text, "settings")
    if flat:
        return Settings(preset, tuple(flat))
    # Parsing the settings takes as long as a few percent of an alignment.
    if preset not in _PRESETS:
        _PRESETS[preset] = Settings(preset)
    return _PRESETS[preset]


#: Presets without changes that were used.
_PRESETS: Final[dict[str, Settings]] = {}


def settings_of(chosen: Settings | str | None) -> Settings:
    """Return settings, those of a preset, or the default ones."""
    if chosen is None or isinstance(chosen, str):
        return settings(chosen or "default")
    if isinstance(chosen, Settings):
        return chosen
    text = f"the settings are a {type(chosen).__name__}; give mocban.settings(...)"
    raise SettingsError(text, "settings")
