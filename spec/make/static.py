"""METADATA and ATTRIBUTE, and their zstd frames."""

import zstandard

from spec.make.base import *


def frame(
    content: bytes,
    *,
    stated: int | None = -1,
    single_segment: bool = True,
    window: int = 0,
    checksum: int | None = -1,
    dictionary: int | None = None,
    reserved: int = 0,
    blocks: bytes | None = None,
) -> bytes:
    """Return a zstd frame (RFC 8878) of raw blocks with `content`, or of the bytes `blocks`. For `stated`, the content
    size, and `checksum`, -1 is the true value and None leaves the field out.

    `window` is the byte Window_Descriptor, used if `single_segment` is false.
    """
    size = len(content) if stated == -1 else stated
    flags = reserved << 3 | (checksum is not None) << 2 | single_segment << 5
    flags |= (3 << 6 if size is not None else 0) | (1 if dictionary is not None else 0)
    out = ZSTD_MAGIC + bytes([flags]) + (b"" if single_segment else bytes([window]))
    out += bytes([dictionary]) if dictionary is not None else b""
    out += struct.pack("<Q", size) if size is not None else b""
    out += raw_block(content, True) if blocks is None else blocks
    if checksum is not None:
        right = zstandard.ZstdCompressor(write_checksum=True).compress(content)[-4:]
        out += right if checksum == -1 else struct.pack("<I", checksum)
    return out


def raw_block(content: bytes, last: bool) -> bytes:
    return struct.pack("<I", len(content) << 3 | last)[:3] + content


def run_block(byte: bytes, count: int, last: bool) -> bytes:
    """Return a repeated byte."""
    return struct.pack("<I", count << 3 | 1 << 1 | last)[:3] + byte


def zeros(count: int) -> bytes:
    """Return blocks of zeros, at most 128 KiB each."""
    sizes = [1 << 17] * (count >> 17) + ([count & (1 << 17) - 1] if count & (1 << 17) - 1 else [])
    return b"".join(run_block(b"\0", size, i == len(sizes) - 1) for i, size in enumerate(sizes))


def plain(content: bytes) -> bytes:
    """Return the simplest frame."""
    return frame(content, checksum=None)


def shuffled(array: np.ndarray) -> bytes:
    return np.frombuffer(array.tobytes(), np.uint8).reshape(-1, array.dtype.itemsize).T.tobytes()


def item_type(name: str) -> tuple[int, int]:
    """Return item_type and Item_Bytes of a type as NumPy writes it."""
    return "buifS".index(name[1]), int(name[2:])


def array_chunk(
    type_: str | tuple[int, int], shape: Sequence[int], body: bytes = b"", name: str | bytes = "a"
) -> bytes:
    """Return ATTRIBUTE. type_: as NumPy writes it, or Item_Type and Item_Bytes."""
    code, size = item_type(type_) if isinstance(type_, str) else type_
    text = name.encode() if isinstance(name, str) else name
    return struct.pack(f"<BBHI{len(shape)}I", code, len(shape), len(text), size, *shape) + text + body


def numbers(array: np.ndarray, type_: str | None = None, name: str = "a") -> bytes:
    return array_chunk(type_ or array.dtype.str, array.shape, plain(shuffled(array)) if array.size else b"", name)


def element(type_: str, content: bytes, name: str = "a") -> bytes:
    """Return a single element of any type."""
    return array_chunk(type_, (), plain(content), name)


def with_static(*entries: tuple[int, bytes]) -> Draft:
    return fork().add(*(Entry(kind, content) for kind, content in entries))


def metadata(text: bytes | str, method: int = 0) -> Draft:
    return with_static((METADATA, bytes([method]) + (text if isinstance(text, bytes) else text.encode())))


def attributes(*contents: bytes) -> Draft:
    return with_static(*((ATTRIBUTE, content) for content in contents))


# A text of 456 bytes compressed by zstd 1.5 at level 19: literals with a Huffman table, sequences with FSE tables.
WIND_FRAME = bytes.fromhex(
    "28b52ffd60c800ad020022451011a0ed1eed626666b605a3aadb6d42a28a6b759b222fa48e0e364efd01138aae2035fb"
    "a691439684d741439ee7d467ee9d9ba6e65e2cb76b7bb06c2fb6558b4b0305004e05f0d550b2ea0815558a6bb10205"
)


def static(title: str, make: Draft | Callable[[], Draft]) -> None:
    invalid(title, make, item="static")


def attribute(title: str, content: bytes) -> None:
    static(f"attribute-{title}", lambda: attributes(content))


FOUR = plain(bytes(16))


def zstd_frame(title: str, body: bytes, size: int = 5) -> None:
    attribute(f"zstd-{title}", array_chunk("|u1", (size,), body))


for title, make in {
    "metadata-plain: METADATA as plain text, with white space around it": lambda: metadata(
        '\t\r\n {"unit": "m", "up_axis": "y", "more": [1, -0, 2.5e-3, true, false, null]} \n'
    ),
    "metadata-zstd: METADATA in a zstd frame of compressed blocks": lambda: metadata(WIND_FRAME, 1),
    "metadata-empty: an object without members": lambda: metadata("{}"),
    "metadata-escapes: escapes, surrogate pairs and text beyond ASCII; the members differ": lambda: metadata(
        '{"\\u0061\\n\\"": "\\ud83c\\udf33", "\u00e9": "\U0001f333\\/", "": {"a": 1, "A": 1}, "\\u0000": ""}'
    ),
    "metadata-long-integer: an integer of 4300 digits": lambda: metadata('{"n": -' + "9" * 4300 + "}"),
    "metadata-nested: 100 levels of nesting": lambda: metadata('{"a":' * 50 + "[" * 50 + "]" * 50 + "}" * 50),
    "metadata-numbers: numbers at the ends of binary64, and below them": lambda: metadata(
        '{"a": [1.7976931348623157e308, -1.797693134862315807e+308, 1e-400, 0e99999, 1E0, '
        "123456789012345678901234567890]}"
    ),
    "attributes: named arrays: a name beyond ASCII, booleans, no dimensions": lambda: attributes(
        numbers(np.linspace(0, 1, 5).astype("<f4"), name="radius"),
        numbers(np.array([0, 1, 2, 255], "|u1"), "|b1", "\U0001f333 ?"),
        numbers(np.array(2.5, "<f8"), name=" "),
    ),
    "attribute-types: one element of every type": lambda: attributes(
        *(
            element(name, bytes(range(1, 1 + int(name[2:]))), name)
            for name in "|b1 |u1 |i1 <i2 <u2 <u4 <i4 <i8 <u8 <f2 <f4 <f8 |S3".split()
        )
    ),
    "attribute-shuffled: planes of bytes of texts of 7 bytes, 3 elements": lambda: attributes(
        array_chunk("|S7", (3,), plain(bytes(range(21))))
    ),
    "attribute-empty: no elements and no data; sizes of 0 count as 1 against the limit": lambda: attributes(
        array_chunk("<f4", (0, 1 << 20, 1 << 6))
    ),
    "attribute-32-dimensions: as many dimensions as there can be": lambda: attributes(
        array_chunk("<u2", [1] * 31 + [2], plain(b"abcd"))
    ),
    "attribute-element-largest: an element of 2^20 bytes": lambda: attributes(
        array_chunk("|S1048576", (), frame(bytes(1 << 20), checksum=None, blocks=zeros(1 << 20)))
    ),
    "attribute-name-longest: a name of 4096 bytes": lambda: attributes(numbers(np.zeros(1, "|u1"), name="n" * 4096)),
    "attributes-256: as many attributes as there can be": lambda: lone().add(
        *(Entry(ATTRIBUTE, element("|u1", bytes([i]), str(i))) for i in range(256))
    ),
    "zstd-checksum: a frame with a Content_Checksum": lambda: attributes(array_chunk("|u1", (5,), frame(b"plant"))),
    "zstd-blocks: raw, repeated and empty blocks, a frame with a window": lambda: attributes(
        array_chunk(
            "|u1",
            (9,),
            frame(
                b"abaaaaaaa",
                checksum=None,
                single_segment=False,
                window=0,
                blocks=raw_block(b"ab", False) + run_block(b"a", 7, False) + raw_block(b"", True),
            ),
        )
    ),
    "zstd-window-8-mib: a window of 8 MiB, the largest that small arrays may ask for": lambda: attributes(
        array_chunk("|u1", (5,), frame(b"plant", checksum=None, single_segment=False, window=13 << 3))
    ),
    "zstd-window-of-array: a window of 9 MiB where the array has 9 MiB": lambda: attributes(
        array_chunk("|u1", (9 << 20,), frame(bytes(9 << 20), checksum=None, blocks=zeros(9 << 20)))
    ),
    "zstd-dictionary-0: Dictionary_ID 0 is none": lambda: attributes(
        array_chunk("|u1", (5,), frame(b"plant", checksum=None, dictionary=0))
    ),
}.items():
    valid(title, make)

for name, why, text in (
    ("empty-text", "no text", b""),
    ("array", "an array, not an object", b"[1]"),
    ("number", "a number", b"1"),
    ("cut", "an object that does not end", b'{"a": 1'),
    ("two", "two objects", b"{} {}"),
    ("zero-behind", "a zero byte behind it", b"{}\0"),
    ("comma", "a comma behind the last member", b'{"a": 1,}'),
    ("quotes", "single quotes", b"{'a': 1}"),
    ("comment", "a comment", b'{"a": 1 /* metre */}'),
    ("nan", "NaN is no number", b'{"a": NaN}'),
    ("infinity", "Infinity is no number", b'{"a": [1, -Infinity]}'),
    ("overflow", "a number that rounds to infinity", b'{"a": {"b": 1.8e308}}'),
    ("leading-zero", "a number with a zero before it", b'{"a": 01}'),
    ("plus", "a number with a plus sign", b'{"a": +1}'),
    ("point", "a number that ends in its point", b'{"a": 1.}'),
    ("hex", "a hexadecimal number", b'{"a": 0x1}'),
    ("twice", "two members of the same name", b'{"a": 1, "a": 1}'),
    ("twice-escaped", "two members of the same name, one escaped", b'{"a": 1, "\\u0061": 2}'),
    ("twice-inside", "two members of the same name, further inside", b'{"a": [{"b": {}, "b": {}}]}'),
    ("surrogate", "half of a surrogate pair", b'{"a": "\\ud83c"}'),
    ("surrogate-name", "a name that is half of a surrogate pair", b'{"\\udf33": 1}'),
    ("surrogates-reversed", "a surrogate pair in the wrong order", b'{"a": "\\udf33\\ud83c"}'),
    ("control", "a line break in a string", b'{"a": "b\nc"}'),
    ("escape", "an escape that JSON does not have", b'{"a": "\\x41"}'),
    ("latin-1", "not UTF-8", '{"a": "\u00e9"}'.encode("latin-1")),
    ("utf-16", "UTF-16", '{"a": 1}'.encode("utf-16-le")),
    ("surrogate-bytes", "a surrogate in UTF-8", b'{"a": "\xed\xa0\xbc"}'),
    ("overlong", "an overlong form in UTF-8", b'{"a": "\xc1\x81"}'),
    ("byte-order-mark", "a byte order mark", b"\xef\xbb\xbf{}"),
    ("white-space", "white space that JSON does not have", b"\x0b{}"),
):
    static(f"metadata-{name}: {why}", lambda text=text: metadata(text))
static("metadata-empty: no bytes", lambda: with_static((METADATA, b"")))
static("metadata-method-2: Method 2", lambda: metadata("{}", 2))
static(
    "metadata-limit LIMIT_EXCEEDED: a text of 2^20 + 1 bytes in a small frame",
    lambda: metadata(
        frame(
            b"{" + b" " * ((1 << 20) - 1) + b"}",
            checksum=None,
            blocks=raw_block(b"{", False)
            + b"".join(run_block(b" ", n, False) for n in [1 << 17] * 7 + [(1 << 17) - 1])
            + raw_block(b"}", True),
        ),
        1,
    ),
)
static(
    "metadata-zstd-size: a frame that does not state its size",
    lambda: metadata(frame(b"{}", stated=None, single_segment=False, checksum=None), 1),
)
static("metadata-zstd-empty: a frame of no bytes", lambda: metadata(plain(b""), 1))
static("metadata-zstd-none: no zstd frame", lambda: metadata("{}", 1))
static("metadata-zstd-text: a frame whose text is no object", lambda: metadata(plain(b"[]"), 1))
static("metadata-zstd-behind: a byte behind the frame", lambda: metadata(plain(b"{}") + b"\0", 1))
attribute("short: seven bytes", array_chunk("<f4", ())[:7])
attribute("shape-short: a chunk that ends in its Shape", array_chunk("<f4", (4,), name="")[:-1])
attribute("name-short: a chunk that ends in its Name", array_chunk("<f4", ())[:-1])
attribute("name-empty: Name_Length 0", array_chunk("<f4", (4,), FOUR, ""))
attribute("name-latin-1: a name that is not UTF-8", array_chunk("<f4", (4,), FOUR, "\u00e9".encode("latin-1")))
attribute("name-surrogate: a surrogate in UTF-8", array_chunk("<f4", (4,), FOUR, b"\xed\xa0\xbc"))
attribute("name-limit LIMIT_EXCEEDED: a name of 4097 bytes", array_chunk("<f4", (4,), FOUR, "n" * 4097))
static(
    "attribute-twice: two attributes of the same name", lambda: attributes(element("|u1", b"1"), element("|u1", b"2"))
)
static(
    "attributes-257 LIMIT_EXCEEDED: 257 attributes",
    lambda: lone().add(*(Entry(ATTRIBUTE, element("|u1", b"a", str(i))) for i in range(257))),
)
for name, why, type_ in (
    ("5", "kind 5", (5, 4)),
    ("reserved", "bit 3 is set", (8 | 3, 4)),
    ("size", "a size that floats do not have", (3, 16)),
    ("float-byte", "a float of one byte", (3, 1)),
    ("integer-size", "integers of 3 bytes", (2, 3)),
    ("unsigned-size", "unsigned integers of 16 bytes", (1, 16)),
    ("boolean-size", "booleans of four bytes", (0, 4)),
    ("nothing", "elements of no bytes", (4, 0)),
    ("element-limit", "elements of 2^20 + 1 bytes", (4, (1 << 20) + 1)),
):
    attribute(f"type-{name}: Item_Type {type_[0]} with Item_Bytes {type_[1]}: {why}", array_chunk(type_, (4,), FOUR))
attribute("shape-33: Dimension_Count 33", array_chunk("<f4", [1] * 33, plain(bytes(4))))
attribute("decoded-limit LIMIT_EXCEEDED: an array of 2^28 + 4 bytes", array_chunk("<f4", ((1 << 26) + 1,), FOUR))
attribute(
    "decoded-limit-vast LIMIT_EXCEEDED: an array of some 2^1024 bytes", array_chunk("<f4", [(1 << 32) - 1] * 32, FOUR)
)
attribute(
    "decoded-limit-of-none LIMIT_EXCEEDED: no elements, but 2^28 + 4 bytes with its size of 0 taken as 1",
    array_chunk("<f4", (0, (1 << 26) + 1)),
)
attribute("data-of-none: no elements, but data", array_chunk("<f4", (0,), plain(b"")))
attribute("no-data: elements, but no data", array_chunk("<f4", (4,)))
for title, make in {
    "none: no zstd frame": b"plant",
    "magic-alone: a frame that ends behind its magic number": ZSTD_MAGIC,
    "cut: a frame that ends in its block": plain(b"plant")[:-1],
    "shorter: a frame of 4 bytes where 5 are": plain(b"plan"),
    "longer: a frame of 6 bytes where 5 are": plain(b"plants"),
    "size-not-stated: a frame that does not state its size": frame(
        b"plant", stated=None, single_segment=False, checksum=None
    ),
    "size-lies-less: a frame that states 5 bytes and holds 6": frame(b"plants", stated=5, checksum=None),
    "size-lies-more: a frame that states 5 bytes and holds 4": frame(b"plan", stated=5, checksum=None),
    "size-memory: a frame of 13 bytes that states some 2^62": bytes.fromhex("28b52ffde06c06060663636363"),
    "byte-behind: a byte behind the frame": plain(b"plant") + b"\0",
    "two-frames: two frames that make the array together": plain(b"pl") + plain(b"ant"),
    "frame-behind: an empty frame behind the frame": plain(b"plant") + plain(b""),
    "skippable-behind: a skippable frame behind the frame": plain(b"plant") + bytes.fromhex("502a4d1800000000"),
    "skippable-before: a skippable frame before the frame": bytes.fromhex("502a4d1800000000") + plain(b"plant"),
    "skippable-alone: a skippable frame of the right size": bytes.fromhex("502a4d1805000000") + b"plant",
    "checksum: a Content_Checksum that does not match": frame(b"plant", checksum=0),
    "dictionary: a frame that needs a dictionary": frame(b"plant", checksum=None, dictionary=7),
    "reserved-bit: the reserved bit of the frame header is set": frame(b"plant", checksum=None, reserved=1),
    "reserved-block: a block of the reserved type": frame(
        b"plant", checksum=None, blocks=struct.pack("<I", 5 << 3 | 3 << 1 | 1)[:3] + b"plant"
    ),
    "bomb: a frame that states 5 bytes and holds a megabyte": frame(b"plant", checksum=None, blocks=zeros(1 << 20)),
    "window LIMIT_EXCEEDED: a window of 9 MiB for 5 bytes": frame(
        b"plant", checksum=None, single_segment=False, window=13 << 3 | 1
    ),
    "window-largest LIMIT_EXCEEDED: the largest window there is": frame(
        b"plant", checksum=None, single_segment=False, window=255
    ),
}.items():
    zstd_frame(title, make)

valid(
    "metadata-longest: a text of 2^20 bytes",
    lambda: metadata(
        frame(
            b"{" + b" " * (LONGEST_TEXT - 2) + b"}",
            checksum=None,
            blocks=raw_block(b"{", False)
            + b"".join(run_block(b" ", n, False) for n in [1 << 17] * 7 + [(1 << 17) - 2])
            + raw_block(b"}", True),
        ),
        1,
    ),
)
zstd_frame("descriptor-alone: a frame that ends before its Window_Descriptor", ZSTD_MAGIC + b"\0")
zstd_frame(
    "header-alone LIMIT_EXCEEDED: a frame of a header alone, with the largest window and no size: the window "
    "comes first",
    ZSTD_MAGIC + b"\0\xff",
)
