"""Exhibits that are pictures already: they become an SVG of their own, as the others are."""

from __future__ import annotations

import base64
import struct

from cospeech.errors import UserError

PNG = b"\x89PNG\r\n\x1a\n"


def as_svg(png: bytes, where: str) -> str:
    """Return an SVG that holds a PNG picture whole.

    Parameters
    ----------
    png : content of the file.
    where : its name, for the message.

    Raises
    ------
    UserError : where the content is no PNG.
    """
    if not png.startswith(PNG) or len(png) < 24:
        raise UserError(f"{where}: no PNG picture; delete it and run again")
    width, height = struct.unpack(">II", png[16:24])
    data = base64.b64encode(png).decode()
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}">'
        f'<image width="{width}" height="{height}" href="data:image/png;base64,{data}"/></svg>\n'
    )
