"""Compiled generation of head angles from pattern labels, frame by frame."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from cospeech.data.arrays import Floats, Integers
from cospeech.kernels.jit import njit

STAGES = 4
"""Number of equal first-order filters that smooth a noise."""

OPEN = -1
"""The end of a segment that has not ended yet."""


class Patterns(NamedTuple):
    """What is generated from: M patterns of N states.

    Attributes
    ----------
    mean, deviation : (M, N, 3) of the angles in each state, degrees.
    edges : (M, N - 1) share of a pattern's duration that has passed at the end of each state but the last.
    expected : (M,) expected duration in frames.
    """

    mean: Floats
    deviation: Floats
    edges: Floats
    expected: Floats


class Memory(NamedTuple):
    """Segments of equal labels, in a ring of K, and how far each has been generated.

    Attributes
    ----------
    label, start, end : (K,) label, first frame, and the frame after the last one or ``OPEN``. passed : (K,) share of
        each segment that has been generated.
    opened, heard, made : (1,) number of segments, of labels that were heard and of frames that were generated.
    """

    label: Integers
    start: Integers
    end: Integers
    passed: Floats
    opened: Integers
    heard: Integers
    made: Integers


def memory(size: int) -> Memory:
    """Return the memory before anything is heard, with room for ``size`` segments."""
    label, start, end = np.zeros((3, size), dtype=np.int64)
    opened, heard, made = np.zeros((3, 1), dtype=np.int64)
    return Memory(label, start, end, np.zeros(size), opened, heard, made)


@njit
def _hear(label: int, memory: Memory) -> None:
    """Continue the last segment with a label, or begin a new one."""
    t, last = memory.heard[0], (memory.opened[0] - 1) % len(memory.label)
    if t == 0 or memory.label[last] != label:
        if t > 0:
            memory.end[last] = t
        new = memory.opened[0] % len(memory.label)
        memory.label[new], memory.start[new], memory.end[new], memory.passed[new] = label, t, OPEN, 0.0
        memory.opened[0] += 1
    memory.heard[0] += 1


@njit
def _make(patterns: Patterns, overlap: int, noise: Floats, memory: Memory, angles: Floats) -> None:
    """Fill ``angles`` (3,) of the next frame with the mean of what the segments at this frame generate.

    A segment begins ``overlap`` frames early and ends as late. It passes through its states in the shares of their
    expected durations. Until its end is heard, it is taken to last as long as expected, or as long as it has lasted.
    """
    t, size = memory.made[0], len(memory.label)
    angles[:] = 0.0
    n_active = 0
    for i in range(max(0, memory.opened[0] - size), memory.opened[0]):
        k = i % size
        m = memory.label[k]
        end = memory.end[k]
        if end == OPEN:
            end = max(memory.heard[0], memory.start[k] + int(patterns.expected[m]))
        if memory.start[k] - overlap > t or end + overlap <= t:
            continue
        step = (1.0 - memory.passed[k]) / (end + overlap - t)
        state = np.searchsorted(patterns.edges[m], memory.passed[k] + 0.5 * step)
        memory.passed[k] += step
        for d in range(3):
            angles[d] += patterns.mean[m, state, d] + patterns.deviation[m, state, d] * noise[n_active, d]
        n_active += 1
    angles /= n_active
    memory.made[0] += 1


@njit
def generate(
    labels: Integers, patterns: Patterns, overlap: int, ahead: int, noise: Floats, memory: Memory, angles: Floats
) -> int:
    """Hear labels (T,), fill ``angles`` (T, 3) with the frames that are due, and return their number.

    A frame is due when the label ``ahead`` frames later has been heard, ``ahead`` > ``overlap``. ``noise`` is
    (T, 2 * overlap + 2, 3).
    """
    n = 0
    for label in labels:
        _hear(label, memory)
        if memory.heard[0] > ahead:
            _make(patterns, overlap, noise[n], memory, angles[n])
            n += 1
    return n


@njit
def finish(patterns: Patterns, overlap: int, noise: Floats, memory: Memory, angles: Floats) -> None:
    """Fill ``angles`` (n, 3) with the frames that are still due when the last label has been heard."""
    memory.end[(memory.opened[0] - 1) % len(memory.label)] = memory.heard[0]
    for n in range(len(angles)):
        _make(patterns, overlap, noise[n], memory, angles[n])


@njit
def medians(frames: Floats, first: int, half: int, found: Floats) -> None:
    """Fill ``found`` (n, 3) with medians of up to ``half`` frames on both sides of frames ``first`` and later."""
    ordered = np.empty(2 * half + 1)
    for n in range(len(found)):
        low, high = max(0, first + n - half), min(len(frames), first + n + half + 1)
        for d in range(frames.shape[1]):
            for count in range(high - low):  # sorted by insertion, as np.median takes a second to compile
                value, place = frames[low + count, d], count
                while place > 0 and ordered[place - 1] > value:
                    ordered[place] = ordered[place - 1]
                    place -= 1
                ordered[place] = value
            below, above = (high - low - 1) // 2, (high - low) // 2
            found[n, d] = 0.5 * (ordered[below] + ordered[above])


@njit
def weighted(frames: Floats, first: int, weights: Floats, found: Floats) -> None:
    """Fill ``found`` (n, 3) with weighted means of frames ``first`` and later; ``weights`` (2 half + 1,) are centred.

    Where frames are missing, the weights of the others are scaled to the sum 1.
    """
    half = len(weights) // 2
    for n in range(len(found)):
        low, high = max(0, first + n - half), min(len(frames), first + n + half + 1)
        found[n] = 0.0
        total = 0.0
        for t in range(low, high):
            weight = weights[t - first - n + half]
            total += weight
            for d in range(frames.shape[1]):
                found[n, d] += weight * frames[t, d]
        for d in range(frames.shape[1]):
            found[n, d] /= total


@njit
def add_noise(noise: Floats, poles: Floats, scale: Floats, past: Floats, frames: Floats) -> None:
    """Add smoothed noise to ``frames`` (T, 3).

    Parameters
    ----------
    noise : (T, C, 3) white noise. poles : (C,) of the filters. scale : (C, 3) of each noise on each axis.
    past : (STAGES, C, 3) last value of each filter, which is the input of the next one.
    """
    for t in range(len(frames)):
        for c in range(len(poles)):
            for d in range(frames.shape[1]):
                value = noise[t, c, d]
                for stage in range(STAGES):
                    past[stage, c, d] += (1.0 - poles[c]) * (value - past[stage, c, d])
                    value = past[stage, c, d]
                frames[t, d] += scale[c, d] * value
