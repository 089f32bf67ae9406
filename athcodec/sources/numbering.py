"""Numbers in the names of files that are one motion, a file for each frame: tree_0001.obj, leaf_0.25.vtu ...

Any one of the files names the motion, and so does a pattern: tree_####.obj or tree_%04d.obj. The number stands at the
end of the name; where it does not tell files apart there, it is the one behind "t" or "time". Digits around a point or
a comma are a decimal number, unless they look like a name and the number of a frame (tree2.0001.obj). Nothing is read
of the files.
"""

from __future__ import annotations

import os
import re
import warnings
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from os import fspath
from pathlib import Path

import numpy as np

from athcodec.errors import ClipError, GuessWarning
from athcodec.files.plain import FilePath
from athcodec.sources import FRAME_SUFFIXES, LISTED, NUMBER_PATTERN, is_pattern

LARGEST_NUMBER = 10**9
FRAME_DIGITS = 3  # Fewest digits behind a point that may be the number of a frame.
_NUMBERED = re.compile(r"(.*?)(-?)(\d+)", re.DOTALL)
_DECIMAL = r"(-?)(\d+)(?:[.,](\d+))?(?:[eE]([-+]?\d+))?"
_AT_END = re.compile(rf"(.*?){_DECIMAL}", re.DOTALL)
_BEHIND_T = re.compile(rf"(?<![^\W_])(?:[tT]|[tT]ime|TIME)[_=-]?{_DECIMAL}(?![\d.,]*\d)")
_TOKENS = re.compile(r"\d+(?:[.,]\d+)?")
_WORD = re.compile(r"[^\W\d_]+$")
_TIME_WORDS = ("t", "time")
# Parts of a name that may tell frames apart: numbers that are no part of a word, decimals, and halves of a day.
_PLACES = re.compile(r"(?<![^\W_])-?\d+|\d+(?=[.,]\d)|-?\d+$|(?<![^\W_])[AaPp][Mm](?![^\W_])")


@dataclass(frozen=True)
class Numbering:
    """How the files of a sequence are called: prefix, the number with at least `width` digits, suffix."""

    folder: Path
    prefix: str
    width: int
    suffix: str

    @classmethod
    def of_pattern(cls, path: Path) -> Numbering | None:
        """Return the pattern of a name with # or %04d in it; None where there is none."""
        match = NUMBER_PATTERN.fullmatch(path.name)
        if match is None:
            return None
        prefix, marks, width, suffix = match.groups()
        return cls(path.parent, prefix, len(marks) if marks.startswith("#") else int(width or 1), suffix)

    def path(self, number: int) -> Path:
        """Return the file of this number."""
        return self.folder / f"{self.prefix}{number:0{self.width}d}{self.suffix}"

    def files(self) -> dict[int, Path]:
        """Return the existing files of the sequence by their numbers, in ascending order."""
        files = {}
        for name, sign, digits in _numbered(self.folder, self.prefix, self.suffix):
            longer = len(digits) - self.width
            is_padded = longer == 0 or longer > 0 and digits[0] != "0" or longer == -1 and sign  # -001 beside 0000
            if is_padded and len(digits) <= len(str(LARGEST_NUMBER)) and not (sign and int(digits) == 0):
                files[int(sign + digits)] = self.folder / name
        return dict(sorted(files.items()))


@dataclass(frozen=True, eq=False)
class NumberedFiles:
    """The files of a sequence.

    paths          in the order of their numbers
    numbers        (T,) float64; None for a single file without a number
    name           what the motion is called by its files; "" where they are called by numbers alone
    has_decimals   whether the numbers have decimals in the names
    is_doubtful    whether decimals were taken for a name and the number of a frame
    """

    paths: tuple[Path, ...]
    numbers: np.ndarray | None = None
    name: str = ""
    has_decimals: bool = False
    is_doubtful: bool = False


def numbering_of(path: FilePath) -> Numbering | None:
    """Return the numbering of the sequence that a pattern, or a file with digits at the end of its stem, belongs to.
    Return None if the file's name has no such digits."""
    path = Path(path)
    if is_pattern(path):
        return Numbering.of_pattern(path)
    numbered = _NUMBERED.fullmatch(path.stem)
    if not numbered:
        return None
    prefix, sign, digits = numbered.groups()
    positive = [number for _, below, number in _numbered(path.parent, prefix, path.suffix) if not below]
    if sign and prefix[-1:].isalnum() and not positive:  # The hyphen of tree-001.obj is no sign.
        prefix, sign = prefix + sign, ""
        positive = [number for _, below, number in _numbered(path.parent, prefix, path.suffix) if not below]
    if digits.startswith("0") and not sign:
        return Numbering(path.parent, prefix, len(digits), path.suffix)
    longest = len(digits) + len(sign)
    padded = [len(number) for number in positive if number.startswith("0") and 1 < len(number) <= longest]
    return Numbering(path.parent, prefix, max(padded, default=len(digits) if digits[0] == "0" else 1), path.suffix)


def _numbered(folder: Path, prefix: str, suffix: str) -> list[tuple[str, str, str]]:
    """Return the names of the files with only a number between prefix and suffix, the sign of each, and its digits."""
    form = re.compile(re.escape(prefix) + r"(-?)([0-9]+)" + re.escape(suffix))
    return [(name, match[1], match[2]) for name in os.listdir(folder) if (match := form.fullmatch(name))]


def numbered_files(path: FilePath) -> NumberedFiles:
    """Return the files of the sequence that `path`, a pattern or any one of the files, belongs to, in the order of
    their numbers. Raises ClipError if a pattern matches no file or two files have the same number, OSError if the
    folder or the file does not exist."""
    path = Path(path)
    if is_pattern(path):
        numbering = Numbering.of_pattern(path)
        assert numbering is not None
        decimals = _Decimals.of(path.parent, numbering.prefix, numbering.suffix)
        files = decimals.files() if numbering.width == 1 and decimals.are_meant() else _whole(numbering)
        if not files.paths:
            raise ClipError(f"{fspath(path)}: got no such files, expected some like {numbering.path(1).name}")
        return files
    files = _at_end(path)
    behind = _behind_t(path) if len(files.paths) == 1 else None
    return files if behind is None else behind


def _at_end(path: Path) -> NumberedFiles:
    """Return the files whose names differ from that of `path` only in the number at the end, or `path` alone."""
    match = _AT_END.fullmatch(path.stem)
    if match is None:
        return NumberedFiles((path,), name=path.stem)
    decimals = _Decimals.of(path.parent, match[1], path.suffix, match[2] if match[1][-1:].isalnum() else "")
    if decimals.are_meant(path.name):
        return decimals.files()
    numbering = numbering_of(path)
    assert numbering is not None
    files = _whole(numbering, decimals.are_doubtful(path.name))
    return files if path in files.paths else NumberedFiles((path,), name=path.stem)


def _behind_t(path: Path) -> NumberedFiles | None:
    """Return the files whose names differ from that of `path` only in a number after "t" or "time", wherever it stands.
    Return None if there is no such number or no second file."""
    for match in _BEHIND_T.finditer(path.stem):
        place = match.start(1)
        decimals = _Decimals.of(path.parent, path.stem[:place], path.stem[match.end() :] + path.suffix)
        if decimals.are_meant(path.name):
            files = decimals.files()
        else:
            digits = match[2]
            width = len(digits) if digits.startswith("0") else 1
            files = _whole(Numbering(path.parent, path.stem[:place], width, path.stem[match.end() :] + path.suffix))
        if len(files.paths) > 1 and path in files.paths:
            return files
    return None


def _whole(numbering: Numbering, is_doubtful: bool = False) -> NumberedFiles:
    files = numbering.files()
    name = numbering.prefix.rstrip("_-. ")
    return NumberedFiles(tuple(files.values()), np.array(list(files), np.float64), name, False, is_doubtful)


@dataclass(frozen=True)
class _Decimal:
    """A number in a name, as it is written there: digits before and behind the point, and of the exponent."""

    file: str
    whole: str
    behind: str
    exponent: str

    @property
    def value(self) -> float:
        return float(f"{self.whole}.{self.behind or 0}e{self.exponent or 0}")


@dataclass(frozen=True)
class _Decimals:
    """Files whose names have a number, which may have decimals, between prefix and suffix."""

    folder: Path
    prefix: str
    numbers: tuple[_Decimal, ...]

    @classmethod
    def of(cls, folder: Path, prefix: str, suffix: str, hyphen: str = "") -> _Decimals:
        """Return the files of a folder whose names are `prefix`, a number that may have decimals, and `suffix`. A
        `hyphen` before the number belongs to the prefix if all files have it; otherwise it is a minus sign."""
        form = re.compile(re.escape(prefix) + _DECIMAL + re.escape(suffix))
        matches = [(match, name) for name in os.listdir(folder) if (match := form.fullmatch(name))]
        if hyphen and all(match[1] for match, _ in matches):
            return cls.of(folder, prefix + hyphen, suffix)
        is_glued = (_word_before(prefix) or "t") not in _TIME_WORDS
        numbers = [_Decimal(name, match[1] + match[2], match[3] or "", match[4] or "") for match, name in matches]
        numbers = [number for number in numbers if not (is_glued and number.exponent)]
        numbers = [number for number in numbers if abs(number.value) <= LARGEST_NUMBER]
        return cls(folder, prefix, tuple(sorted(numbers, key=lambda number: (number.value, number.file))))

    def are_meant(self, named: str = "") -> bool:
        """Return whether the numbers of these files, of which one may be named, are decimals."""
        return self._kind(named) == "decimals"

    def are_doubtful(self, named: str) -> bool:
        """Return whether they are as likely decimals as a name and the number of a frame."""
        return self._kind(named) == "doubtful"

    def _kind(self, named: str) -> str:
        """Return what the numbers in the names are, in view of the file called `named`: "frames" for frame numbers,
        "decimals" for numbers with a decimal point, such as seconds, or "doubtful"."""
        broken = [number for number in self.numbers if number.behind or number.exponent]
        if not broken or len(self.numbers) < 2 or re.search(r"\d[.,]$", self.prefix):  # 31.03.2024, version 1.2.3
            return "frames"
        word = _word_before(self.prefix)
        if word in _TIME_WORDS:
            return "decimals"
        if any(number.exponent for number in broken):
            return "decimals"
        digits = {len(number.behind) for number in broken}
        if len(digits) > 1:  # No decimals end with 0 where others are shorter: 2.9, 2.10 count frames.
            return "frames" if any(len(n.behind) > 1 and n.behind.endswith("0") for n in broken) else "decimals"
        is_wide = digits.pop() >= FRAME_DIGITS
        wholes = {number.whole for number in broken}
        if len(wholes) > 1:
            counts = is_wide and self._follow(broken, named) and not self._are_even()
            return "frames" if word or counts else "decimals"
        if word:  # tree2.0001 is a frame of tree2, leaf0.25 is none of leaf0, and leaf0.001 may be either.
            return "frames" if wholes != {"0"} else "doubtful" if is_wide else "decimals"
        counts = is_wide and len(broken) == len(self.numbers) and self._follow(broken, broken[0].file)
        return "doubtful" if counts and wholes != {"0"} else "decimals"

    @staticmethod
    def _follow(broken: Sequence[_Decimal], named: str) -> bool:
        """Return whether the digits behind the point, of files with the same before it as the named one, count
        frames."""
        whole = next((number.whole for number in broken if number.file == named), broken[0].whole)
        behind = sorted(int(number.behind) for number in broken if number.whole == whole)
        return len(behind) > 1 and behind == list(range(behind[0], behind[-1] + 1))

    def _are_even(self) -> bool:
        steps = np.diff([number.value for number in self.numbers])
        return bool(steps.max() <= 1.001 * steps.min())

    def files(self) -> NumberedFiles:
        """Return the files in ascending order of their numbers. Raises ClipError if two files have the same number."""
        for before, now in zip(self.numbers, self.numbers[1:]):
            if before.value == now.value:
                raise ClipError(
                    f"{self.folder / now.file}: has the number of {before.file}, {now.value:.10g}, expected one file "
                    "for each; move one of them to another folder"
                )
        paths = tuple(self.folder / number.file for number in self.numbers)
        name = re.sub(r"(?<![^\W_])(t|time)$", "", self.prefix, flags=re.IGNORECASE).rstrip("_-. ")
        values = np.array([number.value for number in self.numbers], np.float64)
        return NumberedFiles(paths, values, name, True)


def _word_before(prefix: str) -> str:
    """Return the letters, in lower case, that a number follows at once."""
    word = _WORD.search(prefix)
    return word[0].lower() if word else ""


def files_to_read(path: FilePath) -> NumberedFiles:
    """Return `numbered_files(path)`, and give a GuessWarning that names files that are left out although they may
    belong to the same motion."""
    files, path = numbered_files(path), Path(path)
    if is_pattern(path):
        return files
    names_read = {file.name for file in files.paths}
    form = _PLACES.sub("#", path.stem)
    others = _of_form(path, _PLACES, names_read) if "#" in form else []
    is_alone = len(names_read) == 1 and not path.stem[-1:].isdigit()
    pattern, similar = _pattern_of(path) if is_alone else ("", [])
    if similar and set(others) <= set(similar):
        warnings.warn(
            f"{path}: read as one frame, without {some(similar)}, which differ in a number that is not the last of "
            f"their names; {path.parent / pattern} names all of them as one motion",
            GuessWarning,
            stacklevel=2,
        )
    elif others:
        warnings.warn(
            f"{path}: read as {len(names_read)} of {len(names_read) + len(others)} files, without {some(others)}; "
            f"frames differ in the last number alone, written with as many zeros: to read all as one motion, call them "
            f"NAME_0001{path.suffix}, NAME_0002{path.suffix} ... in the order of time",
            GuessWarning,
            stacklevel=2,
        )
    return files


def _of_form(path: Path, places: re.Pattern[str], names_read: Iterable[str]) -> list[str]:
    """Return names of files that are as that of `path` but for these places."""
    form = places.sub("#", path.stem)
    return sorted(
        name
        for name in set(os.listdir(path.parent)).difference(names_read)
        if name.endswith(path.suffix) and places.sub("#", name.removesuffix(path.suffix)) == form
    )


def _pattern_of(path: Path) -> tuple[str, list[str]]:
    """Return (pattern, names): a pattern with "#" for the one number in which other files' names differ from that of
    `path`, and the names of these files. Return ("", []) if there are none."""
    similar = [name for name in _of_form(path, _TOKENS, [path.name]) if "#" not in name and "%" not in name]
    parts = _TOKENS.findall(path.stem)
    for place, match in enumerate(_TOKENS.finditer(path.stem)):
        numbers = {}
        for name in similar:
            other_parts = _TOKENS.findall(name.removesuffix(path.suffix))
            if (
                other_parts[place] != parts[place]
                and [*other_parts[:place], parts[place], *other_parts[place + 1 :]] == parts
            ):
                numbers[name] = other_parts[place]
        if numbers:
            widths = {len(number) if number.isdigit() else 1 for number in (match[0], *numbers.values())}
            marks = "#" * (widths.pop() if len(widths) == 1 else 1)
            return path.stem[: match.start()] + marks + path.stem[match.end() :] + path.suffix, list(numbers)
    return "", []


def some(names: Sequence[str]) -> str:
    """Return the first of some names, and how many more there are."""
    return ", ".join(names[:LISTED]) + (f" and {len(names) - LISTED} more" if len(names) > LISTED else "")


def each_once(paths: Iterable[str]) -> list[tuple[str, str]]:
    """Return (path, name) for each clip that `paths` stand for, where name is what the clip is called by its file.
    Several files of one numbered sequence become one clip: the first path, called by the files' common prefix. Raises
    ClipError if more than one but not all files of a sequence are given."""
    sequence_of: dict[Path, NumberedFiles] = {}
    named: dict[NumberedFiles | str, list[str]] = {}
    for path in paths:
        if Path(path).suffix.lower() in FRAME_SUFFIXES and os.path.isfile(path) and Path(path) not in sequence_of:
            files = numbered_files(path)
            sequence_of |= dict.fromkeys(files.paths, files)
        named.setdefault(sequence_of.get(Path(path), path), []).append(path)
    return list(_called(named))


def _called(named: dict[NumberedFiles | str, list[str]]) -> Iterator[tuple[str, str]]:
    """Yield (path, name of the clip) for each sequence or single file. `named` has the paths that were given for each
    of them."""
    for files, names in named.items():
        if len(names) == 1 or isinstance(files, str) or files.numbers is None:
            yield from ((path, Path(path).stem) for path in names)
            continue
        if len(set(names)) != len(files.paths):
            raise ClipError(
                f"{names[0]}: got {len(names)} names of a sequence of {len(files.paths)} files, expected one or all of "
                "them; to encode some of its frames, put their files into a folder of their own"
            )
        yield names[0], files.name or files.paths[0].parent.resolve().name
