"""Pack a record for the 3D viewer: original and synthesised motion, phrases, and the voice."""

from cospeech.data import tables
from cospeech.formats import audio
from cospeech.motion import head, library, skeleton
from cospeech.motion.body import STANDARD
from cospeech.viewer import page, takes
from cospeech.viewer.voice import CURVE_S, voice
from cospeech.workflow import job


def version(title, motion, phrases, shown, head_by):
    moved = takes.Articulated(STANDARD, library.from_motion(motion))
    return takes.Version(title, moved, skeleton.frame_rate(motion), phrases, skinned=True, shown=shown, head=head_by)


with job.run(snakemake) as work:
    given, record = work.params, work.wildcards.record
    angles = work.read(work.input.head, "head") if work.input.head else None
    motions = head.moved_where([work.read(path, "motion") for path in work.input.motions], given["headless"], angles)
    phrases = [work.read(path, "segments") for path in work.input.phrases]
    heads = [given["head_by"] if lacks else None for lacks in given["headless"]]
    versions = [
        version(*one)
        for one in zip(given["titles"], motions, phrases, given["shown"], heads, strict=True)
        if not one[1].empty  # not the systems that failed
    ]
    heard = None
    if work.input.audio:
        f0_hz = work.read(work.input.pitch, "pitch")["f0_hz"].to_numpy(dtype=float)
        heard = voice(audio.read(work.input.audio).samples, f0_hz)
    sound = (heard.encoded, heard.duration_s, heard.curves) if heard else (None, 0.0, {})
    take = takes.Take(record, versions, *sound, CURVE_S)
    with tables.replacing(work.output.script) as path:
        path.write_text(page.take_script(f"viewer/{record}.js", take), encoding="utf-8")
