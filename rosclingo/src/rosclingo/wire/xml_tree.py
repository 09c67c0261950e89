"""Parses XML into a small tree that knows the position of each element.

The parser is defusedxml's, because the text is hostile until parsed: document types, entities
and external references are refused.
"""

from __future__ import annotations

import io
import xml.sax
from dataclasses import dataclass
from typing import Dict, List, Mapping, Optional, Union
from xml.sax.handler import ContentHandler
from xml.sax.xmlreader import AttributesImpl, Locator

from defusedxml.common import DefusedXmlException
from defusedxml.expatreader import DefusedExpatParser

from rosclingo.errors import XmlError

_MAX_DEPTH = 16  # levels of elements; the manual's formats need four
MAX_ELEMENTS = 100_000
"""Elements of a request; each takes some hundred bytes, however short its text is."""


@dataclass
class Element:
    """An XML element and its place.

    Attributes:
        name: Name of the element.
        attributes: Values of its attributes.
        line: Line of its start tag, counted from 1.
        column: Column of its start tag, counted from 1.
        children: The elements directly inside.
        text: The character data directly inside, children left out.
    """

    __slots__ = ("attributes", "children", "column", "line", "name", "text")

    name: str
    attributes: Mapping[str, str]
    line: int
    column: int
    children: List[Element]
    text: str

    def error(self, message: str) -> XmlError:
        """Returns an error at this element's place."""
        return XmlError(message, self.line, self.column)


def parse(text: Union[str, bytes], max_elements: Optional[int] = None) -> Element:
    """Parses a text to its root element.

    Args:
        text: The XML; bytes are UTF-8 unless an XML declaration says otherwise.
        max_elements: How many elements it may have; any number if None.

    Raises:
        XmlError: The text is ill-formed, has too many elements, or has a document type, an entity
            or an external reference.
    """
    # In one piece, because expat reads a long token again from its beginning with every piece.
    parser = DefusedExpatParser(bufsize=len(text) + 1, forbid_dtd=True)
    builder = _TreeBuilder(max_elements)
    parser.setContentHandler(builder)
    try:
        parser.parse(io.BytesIO(text) if isinstance(text, bytes) else io.StringIO(text))
    except xml.sax.SAXParseException as err:
        raise XmlError(
            f"ill-formed XML: {err.getMessage()}; attribute values stand in quotes, and & and < "
            "are written &amp; and &lt;",
            err.getLineNumber() or 0,
            (err.getColumnNumber() or 0) + 1,
        ) from err
    except DefusedXmlException as err:
        raise XmlError(
            "document types, entities and external references are not allowed; remove the DOCTYPE",
            *builder.place(),
        ) from err
    except (UnicodeError, LookupError, ValueError, xml.sax.SAXException) as err:
        raise XmlError(f"the text cannot be read: {err}; send UTF-8") from err
    root = builder.root
    if root is None:
        raise XmlError("there is no element")
    return root


class _TreeBuilder(ContentHandler):
    """Builds the tree while the parser reads."""

    def __init__(self, max_elements: Optional[int]) -> None:
        super().__init__()
        self._left = max_elements
        self.root: Optional[Element] = None
        self._open: List[Element] = []
        self._texts: List[List[str]] = []
        self._locator: Optional[Locator] = None

    def setDocumentLocator(self, locator: Locator) -> None:  # noqa: N802 (SAX names it)
        self._locator = locator

    def place(self) -> tuple[int, int]:
        """Returns the line and column that the parser is at, both counted from 1."""
        if self._locator is None:
            return 0, 0
        return self._locator.getLineNumber() or 0, (self._locator.getColumnNumber() or 0) + 1

    def startElement(self, name: str, attrs: AttributesImpl) -> None:  # noqa: N802 (SAX names it)
        attributes: Dict[str, str] = dict(attrs.items())
        element = Element(name, attributes, *self.place(), children=[], text="")
        if self._left is not None:
            self._left -= 1
            if self._left < 0:
                raise element.error("there are too many elements; send several requests")
        if len(self._open) == _MAX_DEPTH:
            raise element.error(f"elements nest deeper than {_MAX_DEPTH} levels")
        if self._open:
            self._open[-1].children.append(element)
        else:
            self.root = element
        self._open.append(element)
        self._texts.append([])

    def characters(self, content: str) -> None:
        self._texts[-1].append(content)

    def endElement(self, name: str) -> None:  # noqa: N802 (SAX names it)
        self._open.pop().text = "".join(self._texts.pop())
