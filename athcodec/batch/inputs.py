"""Which clips a batch has: files, globs, directories and URLs become items, each with a name, settings and an output.

An item is called by its path below the directory that was given, or before the first wildcard; a plain file by its
name. Its output has that name with the suffix .ath. In directories files with the suffixes of readable formats are
taken, but not those of formats that have one file per frame, which take a pattern of their own (walk_####.obj).
"""

from __future__ import annotations

import glob
import hashlib
import os
import posixpath
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import urlsplit

from athcodec.batch.settings import Settings, check_settings, settings_of
from athcodec.decoding.container import MAGIC
from athcodec.errors import ClipError, MissingExtra, RemoteError
from athcodec.files.atomic import is_url
from athcodec.files.plain import FilePath
from athcodec.files.remote import _one_line, guarded
from athcodec.files.shown import without_secrets
from athcodec.sources import FRAME_SUFFIXES, NUMBER_PATTERN, SERIES, formats, is_pattern
from athcodec.sources.numbering import each_once, numbered_files
from athcodec.untyped import JsonMapping, JsonObject

TAGS = (
    "ETag",
    "Last-Modified",
    "Content-MD5",
    "LastModified",
    "last_modified",
    "mtime",
    "md5Hash",
    "generation",
    "created",
)  # File systems report these fields differently once a file has changed.


@dataclass(frozen=True)
class Item:
    """A clip of a batch.

    Parameters
    ----------
    name : str
        Its path below the directory that was given, or the name of a plain file.
    input, output : str
        Where it is, and where its .ath file goes: absolute paths or URLs.
    settings : dict
        As `check_settings` gives them.
    """

    name: str
    input: str
    output: str
    settings: Settings

    @property
    def fingerprint(self) -> str:
        """Return a name for the output: short, and of plain characters whatever the inputs' names have."""
        return hashlib.sha256(os.fsencode(self.output)).hexdigest()[:16]

    @property
    def shown(self) -> str:
        """The input as messages and the manifest show it."""
        return without_secrets(self.input) if is_url(self.input) else self.input


def find(
    inputs: Iterable[FilePath],
    output: FilePath,
    *,
    settings: JsonMapping | None = None,
    patterns: Mapping[str, JsonMapping] | None = None,
) -> list[Item]:
    """List the clips that a batch encodes, each with its output file and its settings.

    Parameters
    ----------
    inputs : iterable of str or path
        Files, folders (with all clips below them), patterns of names such as "*.h5", and URLs.
    output : str or path
        The directory of the .ath files, a path or a URL.
    settings : dict, optional
        Settings of all clips; see `check_settings`.
    patterns : dict of str to dict, optional
        Further settings by pattern of the clips' names; see `load_settings`.

    Returns
    -------
    list of Item
        The clips in the order of their names.

    Raises
    ------
    ClipError
        If an input stands for no clip, a setting does not exist, or two inputs would have the same output.
    OSError
        If an input does not exist.
    """
    default = check_settings(settings or {})
    checked = {pattern: check_settings(stated, f'["{pattern}"]') for pattern, stated in (patterns or {}).items()}
    items: dict[str, Item] = {}
    for name, path in _named(inputs):
        target = _target(os.fspath(output), _stem(name, path) + ".ath")
        item = Item(name, path, target, settings_of((name, path), default, checked))
        other = items.setdefault(target, item)
        if other.input != path:
            place = without_secrets(target) if is_url(target) else target
            raise ClipError(f"{item.shown}: would be {place}, as would {other.shown}; expected a name of its own")
    if not items:
        raise ClipError("inputs: got no clips, expected at least one")
    return sorted(items.values(), key=lambda item: item.name)


def _target(output: str, name: str) -> str:
    """Return the absolute path, or the URL, of the file `name` in the folder `output`. Raises ClipError for a URL with
    a query or of several file systems."""
    if not is_url(output):
        return os.path.abspath(os.path.join(output, name))
    if "::" in output or "?" in output:
        raise ClipError(
            f"{without_secrets(output)}: got a chain of file systems or a query, expected the plain URL of a directory"
        )
    return f"{output.rstrip('/')}/{name}"


def _stem(name: str, path: str) -> str:
    """Return a name without its suffix, and without the place of the numbers of a series: walk_####.obj is walk."""
    head, tail = posixpath.split(name)
    series = NUMBER_PATTERN.fullmatch(tail) if not is_url(path) and is_pattern(path) else None
    if series:  # prefix, place, width, and what is behind it with the suffix
        return posixpath.join(head, (series[1] + Path(f"n{series[4]}").stem[1:]).strip("_.- ") or "frames")
    return os.path.splitext(name)[0]


def _named(inputs: Iterable[FilePath]) -> Iterator[tuple[str, str]]:
    """Yield (name, path or URL) of each clip that the inputs, which are files, folders, patterns and URLs, stand for.
    Raises ClipError if an input stands for none."""
    for text, called in each_once(os.fspath(each) for each in inputs):
        pairs = list(_remote(text) if is_url(text) else _local(text, called))
        yield from pairs
        if not pairs:
            raise ClipError(
                f"{text}: got no clips, expected a file, a directory with clips or a pattern that fits some"
            )


def _local(text: str, called: str) -> Iterator[tuple[str, str]]:
    """Yield (name, path) of each clip that a local path stands for: a file, a folder with all below it, or a pattern.
    `called` is the name of a single file without its suffix. Raises FileNotFoundError."""
    if os.path.isdir(text):
        yield from _below(
            text,
            (
                os.path.join(folder, name)
                for folder, folders, names in os.walk(text)
                for _ in [folders.sort()]
                for name in sorted(names)
                if _is_clip(name)
            ),
        )
    elif os.path.exists(text) or is_pattern(text):
        yield called + Path(text).suffix, os.path.abspath(text)
    elif glob.has_magic(text):
        yield from _below(
            _fixed_part(text, os.sep),
            (path for path in sorted(glob.glob(text, recursive=True)) if os.path.isfile(path)),
        )
    else:
        raise FileNotFoundError(f"{text}: No such file or directory")


def _below(folder: str, paths: Iterable[str]) -> Iterator[tuple[str, str]]:
    for path, called in each_once(paths):
        name = Path(os.path.relpath(path, folder or "."))
        yield name.with_name(called + name.suffix).as_posix(), os.path.abspath(path)


def _is_clip(name: str) -> bool:
    return not name.startswith(".") and name.lower().endswith(_clip_suffixes())


@cache
def _clip_suffixes() -> tuple[str, ...]:
    return SERIES, *(suffix for form in formats() for suffix in form.suffixes if suffix not in FRAME_SUFFIXES)


def _fixed_part(pattern: str, separator: str) -> str:
    """Return the directory before the first wildcard."""
    parts = pattern.split(separator)
    first = next(place for place, part in enumerate(parts) if glob.has_magic(part))
    return separator.join(parts[:first]) or (separator if pattern.startswith(separator) else "")


# ---- URLs ----


def _remote(url: str) -> Iterator[tuple[str, str]]:
    """Yield (name, URL) of each clip that a URL stands for: a single file, a folder with all below it, or a pattern.
    Raises RemoteError, ClipError."""
    shown = without_secrets(url)
    is_folder = url.endswith("/")
    if not is_folder and not glob.has_magic(url.partition("?")[0]):
        yield posixpath.basename(url.partition("?")[0].partition("::")[0]), url
        return
    if "::" in url:
        raise ClipError(f"{shown}: got a pattern in a chain of file systems, expected a single file")
    system, path = file_system(url)
    try:
        paths = system.find(path) if is_folder else system.glob(path)
    except Exception as error:  # each file system has errors of its own
        raise RemoteError(f"{shown}: {type(error).__name__}: {_one_line(error)}") from None
    base = path.rstrip("/") if is_folder else _fixed_part(path, "/")
    for found_path in sorted(paths):
        if not is_folder or _is_clip(posixpath.basename(found_path)):
            yield posixpath.relpath(found_path, base) if base else found_path, system.unstrip_protocol(found_path)


def file_system(url: str) -> tuple[Any, str]:
    """Return (file system, path): fsspec's file system for a URL, and the path of the URL in it. Raises MissingExtra,
    RemoteError."""
    try:
        import fsspec

        is_http = urlsplit(url).scheme.lower() in ("http", "https")
        return fsspec.core.url_to_fs(url, **({"skip_instance_cache": True} | guarded(url, {}) if is_http else {}))
    except ImportError as error:
        raise MissingExtra(f'{without_secrets(url)}: {_one_line(error)}: pip install "athcodec[remote]"') from None
    except ValueError as error:
        raise RemoteError(f"{without_secrets(url)}: {_one_line(error)}") from None


def download(url: str, path: str) -> str:
    """Download the file at `url` to the local `path`, and return its SHA-256 as text. Raises RemoteError, OSError."""
    system, source = file_system(url)
    try:
        system.get_file(source, path)
    except Exception as error:
        if isinstance(error, OSError) and error.errno and error.filename == path:
            raise  # The local disk failed, which no retry mends.
        raise RemoteError(f"{without_secrets(url)}: {type(error).__name__}: {_one_line(error)}") from None
    return sha256(path)


def upload(path: str, url: str) -> JsonObject:
    """Store the .ath file `path` at `url`, where it may replace an .ath file but nothing else. Return its identity
    there, as `remote_identity` does. Raises RemoteError, OSError."""
    system, target = file_system(url)
    try:
        others = system.exists(target) and system.cat_file(target, start=0, end=len(MAGIC)) not in (b"", MAGIC)
    except Exception as error:
        raise RemoteError(f"{without_secrets(url)}: {type(error).__name__}: {_one_line(error)}") from None
    if others:
        raise RemoteError(f"{without_secrets(url)}: is there already and no .ath file; choose another --out")
    try:
        system.makedirs(system._parent(target), exist_ok=True)
        system.put_file(path, target)
    except Exception as error:
        raise RemoteError(f"{without_secrets(url)}: {type(error).__name__}: {_one_line(error)}") from None
    return remote_identity(url)


# ---- what a file is known again by ----


def identity(item: Item) -> JsonObject:
    """Return size and time of an input, and of files that its settings name; of a URL, what its server says. Of formats
    that spread over several files, others than numbered series, only the named file counts. Raises OSError."""
    if is_url(item.input):
        known = remote_identity(item.input)
    else:
        known = _files_identity(_frames(item.input))
    others = [item.settings[name] for name in ("mesh", "hierarchy") if os.path.isabs(item.settings.get(name, ""))]
    return known | ({"with": [_files_identity([path]) for path in others]} if others else {})


def is_telling(known: JsonObject) -> bool:
    """Return whether an identity would show that a file has changed, though not its size."""
    return any(name in known for name in ("mtime_ns", *TAGS))


def _frames(path: str) -> list[str]:
    if path.lower().endswith(FRAME_SUFFIXES) or is_pattern(path):
        return [str(file) for file in numbered_files(path).paths]
    return [path]


def _files_identity(paths: list[str]) -> JsonObject:
    stats = [os.stat(path) for path in paths]
    known = {"size": sum(stat.st_size for stat in stats), "mtime_ns": max(stat.st_mtime_ns for stat in stats)}
    return known | ({"files": len(stats)} if len(stats) > 1 else {})


def remote_identity(url: str) -> JsonObject:
    """Return the size, and tags such as ETag, that a server states now for the file at `url`, by which a later change
    shows. Raises RemoteError."""
    system, path = file_system(url)
    system.invalidate_cache()
    try:
        info = system.info(path)
    except Exception as error:
        raise RemoteError(f"{without_secrets(url)}: {type(error).__name__}: {_one_line(error)}") from None
    return {"size": info.get("size")} | {name: str(info[name]) for name in TAGS if info.get(name)}


def sha256(path: FilePath) -> str:
    """Return the digest of a file's content. Raises OSError."""
    with open(path, "rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()
