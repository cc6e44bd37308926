"""A checksum of a whole file within the file: no bit of it can change unnoticed.

Parquet's own checksums are of its pages only, not of what says where they are and what they mean.
"""

from __future__ import annotations

import hashlib

_MARK = b"okiagari-sha256:"
_LENGTH = 64
BLANK = (_MARK + b"0" * _LENGTH).decode()
"""To be put into a file once, anywhere, before it is sealed."""


def add_checksum(content: bytes) -> bytes:
    """The content with the digest of it (as it is now) in the place of `BLANK`."""
    if content.count(_MARK) != 1:
        raise ValueError("a file is sealed at exactly one place")
    at = content.index(_MARK) + len(_MARK)
    return content[:at] + _digest(content, at) + content[at + _LENGTH :]


def has_checksum(content: bytes) -> bool:
    """Whether there is a checksum at all, right or wrong."""
    return _MARK in content


def is_intact(content: bytes) -> bool:
    """Whether the content is bit for bit what was sealed."""
    at = content.find(_MARK) + len(_MARK)
    return has_checksum(content) and content[at : at + _LENGTH] == _digest(content, at)


def _digest(content: bytes, at: int) -> bytes:
    """SHA-256 of the content with a blank checksum."""
    view, digest = memoryview(content), hashlib.sha256()
    for part in (view[:at], BLANK.encode()[len(_MARK) :], view[at + _LENGTH :]):
        digest.update(part)
    return digest.hexdigest().encode()
