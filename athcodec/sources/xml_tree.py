"""XML that is not trusted, as a tree of elements."""

from __future__ import annotations

import re
from xml.etree import ElementTree

from athcodec.errors import ClipError
from athcodec.files.reading import Budget

XML_BYTES, TEXT_BYTES = 224, 40  # Bytes that an element or attribute takes, and a byte of text that becomes numbers.
_NAMED_DOCTYPE = re.compile(
    rb"""<!DOCTYPE\s++[\w.:-]++(\s++SYSTEM\s++("[^"<>]*+"|'[^'<>]*+'))?+\s*+(\[\s*+\])?+\s*+>"""
)


def parse_xml(data: bytes, tag: str, budget: Budget) -> ElementTree.Element:
    """Return the root element of the XML in `data`, whose name has to be `tag`. Raises ClipError for another root, for
    broken XML, and for a DOCTYPE with declarations, because entities can grow without end."""
    if b"<!DOCTYPE" in _NAMED_DOCTYPE.sub(b"", data, count=1) or b"\0" in data:
        raise ClipError("got XML with declarations in its DOCTYPE or in UTF-16, expected plain UTF-8 without any")
    budget.need_for(data, b"<=", XML_BYTES, "XML")
    try:
        root = ElementTree.fromstring(data)
    except (ElementTree.ParseError, LookupError, ValueError) as error:  # LookupError: an unknown encoding
        raise ClipError(f"got no XML: {error}") from None
    if root.tag.rpartition("}")[2] != tag:
        raise ClipError(f"got the XML of {root.tag[:40]!r}, expected {tag}")
    return root
