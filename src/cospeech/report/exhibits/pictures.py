"""Exhibits that other rooms made as pictures: they become an SVG of their own, as the others are."""

from __future__ import annotations

import base64
import struct

import pandas as pd

from cospeech.errors import UserError
from cospeech.report.exhibits.run import Drawing, Run

PNG = b"\x89PNG\r\n\x1a\n"


def draw(_: Run, picture: bytes) -> Drawing:
    """Show a picture as it is."""
    return Drawing(picture=picture)


def stills(_: Run, picture: bytes, stills: pd.DataFrame) -> Drawing:
    """Show a typical picture of each gesture class, and where each was taken."""
    return Drawing(numbers=stills, picture=picture)


def checked(content: bytes, where: str) -> bytes:
    """Return the content of a picture file.

    Parameters
    ----------
    content : of the file.
    where : its path, for the message.

    Raises
    ------
    UserError : if it is not a PNG picture.
    """
    if not content.startswith(PNG) or len(content) < 24:
        raise UserError(f"{where} is not a PNG picture; delete it and run again")
    return content


def as_svg(png: bytes) -> str:
    """Return an SVG that contains a whole PNG picture."""
    width, height = struct.unpack(">II", png[16:24])
    data = base64.b64encode(png).decode()
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}">'
        f'<image width="{width}" height="{height}" href="data:image/png;base64,{data}"/></svg>\n'
    )
