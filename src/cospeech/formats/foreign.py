"""Bytes and text of files that other programs wrote, within limits on size.

A reader checks a file's own statements about its size against these limits before it allocates memory for them, so
that a damaged or malicious file ends in one line instead of filling the memory or running for minutes.
"""

from __future__ import annotations

import stat
import unicodedata
from pathlib import Path

from cospeech.errors import UserError

MAX_FILE_MB = 512
"""Largest file, and largest array or table in a compressed file."""

MAX_RATIO, FREE_MB = 100, 50
"""Largest ratio of the unpacked to the packed size, from this size on; numbers that were measured reach 20."""

MAX_JOINTS = 1000
"""Largest number of joints of a skeleton; a body with face and fingers has about 300."""

MAX_JOINT_FRAMES = 20_000_000
"""Largest number of frames times joints: 46 minutes of 60 joints at 120 frames per second."""

ENCODINGS = {
    "Shift-JIS": "shift_jis",
    "EUC-JP": "euc_jp",
    "GBK": "gbk",
    "EUC-KR": "euc_kr",
    "Big5": "big5",
    "Windows-1252": "cp1252",
}
"""Encodings other than Unicode that names are tried in, for messages."""


def read_bytes(path: str | Path) -> bytes:
    """Return the content of a file.

    Raises
    ------
    UserError : if it cannot be read, is not a regular file, or is larger than ``MAX_FILE_MB``.
    """
    try:
        status = Path(path).stat()
        if not stat.S_ISREG(status.st_mode):
            raise UserError(f"{path}: is not a regular file; correct the path")
        check_size(status.st_size, str(path))
        return Path(path).read_bytes()
    except OSError as error:
        raise UserError(f"{path}: cannot be read ({error.strerror}); correct the path") from error


def check_size(n_bytes: int, what: str) -> None:
    """Raise UserError if a file or an array in it is larger than ``MAX_FILE_MB``."""
    if n_bytes > MAX_FILE_MB * 1_000_000:
        raise UserError(
            f"{what}: has {n_bytes / 1e6:.0f} MB, more than the limit of {MAX_FILE_MB} MB; cut it into shorter files"
        )


def check_unpacked(n_bytes: int, packed_bytes: int, what: str) -> None:
    """Raise UserError if a part of a compressed file unpacks to more than ``MAX_FILE_MB``, or is a zip bomb."""
    check_size(n_bytes, what)
    if n_bytes > FREE_MB * 1_000_000 and n_bytes > MAX_RATIO * packed_bytes:
        raise UserError(
            f"{what}: unpacks from {packed_bytes / 1e6:.1f} to {n_bytes / 1e6:.0f} MB, unlike motion data; save it "
            "uncompressed if it is right"
        )


def check_joint_frames(n_joints: int, n_frames: int, path: str | Path) -> None:
    """Raise UserError if a skeleton or its motion is larger than ``MAX_JOINTS`` or ``MAX_JOINT_FRAMES``."""
    if n_joints > MAX_JOINTS:
        raise UserError(f"{path}: has more than {MAX_JOINTS} joints; export only the joints of the body")
    if n_joints * n_frames > MAX_JOINT_FRAMES:
        raise UserError(
            f"{path}: has {n_frames} frames of {n_joints} joints, more than the limit of "
            f"{MAX_JOINT_FRAMES // n_joints} frames; cut it into shorter files"
        )


def decode(content: bytes, path: str | Path) -> str:
    """Return text in UTF-8 or, after a byte order mark, UTF-16.

    Raises
    ------
    UserError : if it is in another encoding; the message names those that are possible.
    """
    try:
        if content.startswith((b"\xff\xfe", b"\xfe\xff")):
            return content.decode("utf-16")
        return content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        if error.encoding != "utf-8":
            raise UserError(f"{path}: is not text in UTF-16, which its first bytes announce; save it again") from None
        before = content[: error.start]
        number = before.count(b"\n") + 1
        line = content[before.rfind(b"\n") + 1 :].split(b"\n", 1)[0][:200]
    raise UserError(f"{path}: line {number} is not in UTF-8 ({_readings(line)}); convert the file to UTF-8")


def normalised(name: str) -> str:
    """Return a name with composed Unicode characters, single spaces, and without quotation marks around it.

    Two names that look the same are then equal.
    """
    joined = unicodedata.normalize("NFC", " ".join(name.split()))
    return joined[1:-1].strip() if len(joined) > 2 and joined[0] == joined[-1] == '"' else joined


def _readings(line: bytes) -> str:
    """Return the readings of a line in other encodings, such as "left arm in Japanese characters in EUC-JP"."""
    found = []
    for name, codec in ENCODINGS.items():
        try:
            text = line.decode(codec).strip()
        except UnicodeDecodeError:
            continue
        words = [word for word in text.split() if not word.isascii()]
        half_width = any("\uff61" <= character <= "\uff9f" for word in words for character in word)
        if words and not half_width and all(character.isprintable() for word in words for character in word):
            found.append(f"'{words[0][:20]}' in {name}")
    return " or ".join(found) or "its encoding is unknown"
