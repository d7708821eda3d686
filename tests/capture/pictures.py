"""Small synthetic images of markers for the tracking tests: discs on a dark suit, with sixteen samples per pixel."""

import av
import numpy as np
from scipy.ndimage import convolve1d

from cospeech.capture.tracking.colour import SKIN, chroma
from cospeech.motion.markers import COLOURS

SUIT = (26, 26, 30)


def draw(size, discs, noise=2.0, seed=0):
    """Return Y, Cb, Cr (3, H, W) of discs (x, y, radius, colour) painted in order.

    A colour is that of a marker, 'skin' or 'suit'.
    """
    (width, height), fine = size, 4
    paint = {**COLOURS, "skin": SKIN, "suit": SUIT}
    picture = np.empty((height, width, 3))
    picture[:] = SUIT
    for x, y, radius, colour in discs:
        left, right = max(0, int(x - radius) - 2), min(width, int(x + radius) + 3)
        top, bottom = max(0, int(y - radius) - 2), min(height, int(y + radius) + 3)
        if right <= left or bottom <= top:
            continue
        u = left + (np.arange((right - left) * fine) + 0.5) / fine - 0.5
        v = top + (np.arange((bottom - top) * fine) + 0.5) / fine - 0.5
        inside = (u[None] - x) ** 2 + (v[:, None] - y) ** 2 < radius**2
        cover = inside.reshape(bottom - top, fine, right - left, fine).mean(axis=(1, 3))[..., None]
        part = picture[top:bottom, left:right]
        part[:] = (1 - cover) * part + cover * np.array(paint[colour])
    for axis in (0, 1):
        picture = convolve1d(picture, [0.15, 0.7, 0.15], axis)
    picture += np.random.default_rng(seed).normal(0, noise, picture.shape)
    planes = chroma(picture) + np.array([0, 128, 128])
    return np.clip(np.round(planes), 0, 255).astype(np.uint8).transpose(2, 0, 1).copy()


def write(path, pictures, fps=20):
    """Write images (3, H, W) in Y, Cb, Cr as a film (MJPEG 4:4:4 in Matroska)."""
    with av.open(str(path), "w") as container:
        stream = container.add_stream("mjpeg", rate=fps)
        stream.height, stream.width = pictures[0].shape[1:]
        stream.pix_fmt = "yuvj444p"
        stream.codec_context.qmin = stream.codec_context.qmax = 2
        for picture in pictures:
            frame = av.VideoFrame.from_ndarray(picture, format="yuvj444p")
            container.mux(stream.encode(frame))
        container.mux(stream.encode())


def subsampled(plane):
    """Return a chroma plane at half resolution with the siting of H.264: co-sited horizontally, between two lines."""
    wide = np.pad(plane.astype(float), ((0, 0), (1, 1)), mode="edge")
    across = ((wide[:, :-2] + 2 * wide[:, 1:-1] + wide[:, 2:]) / 4)[:, ::2]
    return (across[::2] + across[1::2]) / 2


def ordinary(picture):
    """Return an image (3, H, W) as a frame in the format of most cameras: 4:2:0 in limited range."""
    chroma = (128 + (subsampled(plane) - 128) * (224 / 255) for plane in picture[1:])
    planes = [16 + picture[0] * (219 / 255), *chroma]
    flat = np.concatenate([np.round(plane).astype(np.uint8).ravel() for plane in planes])
    return av.VideoFrame.from_ndarray(flat.reshape(-1, picture.shape[2]), format="yuv420p")
