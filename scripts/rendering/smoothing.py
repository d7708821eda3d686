"""Apply each smoothing filter to one joint angle around a phrase boundary."""

from cospeech.motion import assembly, skeleton, unit_selection
from cospeech.workflow import job

with job.run(snakemake) as work:
    motions = {
        record: work.read(path, "motion")
        for record, path in zip(work.params["others"], work.input.motions, strict=True)
    }
    pool = unit_selection.templates(work.read(work.input.gestures, "segments"), motions)
    selected = work.read(work.input.units, "units")
    motion = work.read(work.input.made, "motion")
    angles = assembly.join(selected, pool, motions, len(motion))
    table = assembly.trial(angles, assembly.boundaries(selected), work.params["window"], skeleton.frame_rate(motion))
    table = table.assign(system=work.params["system"], record=work.params["record"])
    work.write(table, work.output.table, "smoothing_trial")
